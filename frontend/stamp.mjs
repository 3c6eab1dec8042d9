// Writes beside the bundle what it was built from, and the licences of what is in it.
import { createHash } from "node:crypto";
import { readdirSync, readFileSync, renameSync, writeFileSync } from "node:fs";
import { join } from "node:path";

const STATIC = "../src/superfacets/studio/static";
const LIBRARIES = ["three", "three-mesh-bvh"];
const SINGLE_FILES = ["index.html", "package.json", "package-lock.json", "tsconfig.json", "vite.config.js", "stamp.mjs"];

/** Every file in a folder, as paths with slashes, in the order of their names. */
function filesIn(folder) {
  return readdirSync(folder, { withFileTypes: true })
    .flatMap((entry) => {
      const path = `${folder}/${entry.name}`;
      return entry.isDirectory() ? filesIn(path) : [path];
    });
}

function hashOf(path) {
  return createHash("sha256").update(readFileSync(path)).digest("hex");
}

const sources = [...SINGLE_FILES, ...filesIn("src")].sort();
writeFileSync(
  join(STATIC, "SOURCES.sha256"),
  sources.map((path) => `${hashOf(path)}  ${path}\n`).join(""),
);

const licences = LIBRARIES.map((name) => {
  const { version, license } = JSON.parse(readFileSync(`node_modules/${name}/package.json`, "utf8"));
  const text = readFileSync(`node_modules/${name}/LICENSE`, "utf8").trim();
  return `${name} ${version} (${license})\n\n${text}\n`;
});
writeFileSync(
  join(STATIC, "THIRD_PARTY"),
  `studio.js and prepare-worker.js contain the libraries below.\n\n${licences.join("\n" + "-".repeat(78) + "\n\n")}`,
);
