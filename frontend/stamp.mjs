// Writes beside each bundle the hashes of the sources that it was built from.
import { createHash } from "node:crypto";
import { readdirSync, readFileSync, writeFileSync } from "node:fs";

const COMMON = ["package.json", "package-lock.json", "tsconfig.json", "vite.config.js", "stamp.mjs"];
const BUNDLES = [
  { into: "../src/superfacets_studio/static", folder: "src/studio", files: ["index.html"] },
  { into: "../src/superfacets_show/page", folder: "src/page", files: [] },
];

/** Every file in a folder, as paths with slashes. */
function filesIn(folder) {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const path = `${folder}/${entry.name}`;
    return entry.isDirectory() ? filesIn(path) : [path];
  });
}

for (const { into, folder, files } of BUNDLES) {
  const sources = [...COMMON, ...files, ...filesIn(folder), ...filesIn("src/shared")].sort();
  const lines = sources.map((path) => {
    const hash = createHash("sha256").update(readFileSync(path)).digest("hex");
    return `${hash}  ${path}\n`;
  });
  writeFileSync(`${into}/SOURCES.sha256`, lines.join(""));
}
