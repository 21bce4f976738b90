// Khronos' glTF validator on every file given: no error and no warning is allowed.
//
//     npm install --no-save --prefix /tmp/readers gltf-validator
//     NODE_PATH=/tmp/readers/node_modules node tests/readers/validate_glb.mjs results/in-plane-pair/scene.glb

import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";

// `require` looks at NODE_PATH, `import` does not.
const { validateBytes } = createRequire(import.meta.url)("gltf-validator");

const files = process.argv.slice(2);
if (files.length === 0) {
  console.error("usage: node validate_glb.mjs FILE.glb ...");
  process.exit(1);
}

let failed = false;
for (const file of files) {
  try {
    const report = await validateBytes(new Uint8Array(await readFile(file)), { uri: file });
    const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
    const bad = numErrors + numWarnings > 0;
    failed ||= bad;
    const { drawCallCount, animationCount, totalTriangleCount } = report.info ?? {}; // missing where the file cannot be read at all
    console.log(
      `${bad ? "FAIL" : "ok  "} ${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ` +
        `${numHints} hints; ${drawCallCount} bodies, ${totalTriangleCount} triangles, ${animationCount} animations`,
    );
    for (const { code, message, pointer, severity } of messages) {
      console.log(`     severity ${severity} ${code} at ${pointer}: ${message}`);
    }
  } catch (error) {
    failed = true;
    console.log(`FAIL ${file}: ${error}`);
  }
}
process.exit(failed ? 1 : 0);
