// Two bundles of one source: the studio's, and with `--mode page` the script of a page. Both are
// committed: their names carry no hash, and the same sources give the same bytes.
import { defineConfig } from "vite";

const SRC = "../src";
const COMMON = { target: "es2022", modulePreload: false, reportCompressedSize: false };

const studio = {
  base: "/static/",
  build: {
    ...COMMON,
    outDir: `${SRC}/superfacets_studio/static`,
    emptyOutDir: true,
    rollupOptions: {
      input: { studio: "index.html" },
      output: { entryFileNames: "[name].js", chunkFileNames: "[name].js", assetFileNames: "[name][extname]" },
    },
  },
};

const page = {
  build: {
    ...COMMON,
    outDir: `${SRC}/superfacets_show/page`,
    emptyOutDir: false,
    lib: { entry: "src/page/main.ts", formats: ["iife"], name: "viewer", fileName: () => "viewer.js" },
  },
};

export default defineConfig(({ mode }) => (mode === "page" ? page : studio));
