// The bundle is committed: its names carry no hash, and the same sources give the same bytes.
import { defineConfig } from "vite";

const plainNames = {
  entryFileNames: "[name].js",
  chunkFileNames: "[name].js",
  assetFileNames: "[name][extname]",
};

export default defineConfig({
  base: "/static/",
  build: {
    outDir: "../src/superfacets/studio/static",
    emptyOutDir: true,
    target: "es2022",
    modulePreload: false,
    chunkSizeWarningLimit: 1000,
    rollupOptions: { input: { studio: "index.html" }, output: plainNames },
  },
  worker: { format: "es", rollupOptions: { output: plainNames } },
});
