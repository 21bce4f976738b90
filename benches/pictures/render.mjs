// Draws glTF files with three.js in a browser without a window: one PNG for the first and one for the last load step.
//
//     npm install --no-save --prefix /tmp/pictures three @sparticuz/chromium puppeteer-core
//     NODE_PATH=/tmp/pictures/node_modules node benches/pictures/render.mjs OUT scene.glb=NAME ...

import { createServer } from "node:http";
import { readFile, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { join, sep } from "node:path";

// `require` looks at NODE_PATH, `import` does not.
const require = createRequire(import.meta.url);
const puppeteer = require("puppeteer-core").default ?? require("puppeteer-core");
const packed = require("@sparticuz/chromium");
const chromium = packed.default ?? packed;

const [out, ...jobs] = process.argv.slice(2);
const scenes = jobs.map((job) => job.split("="));
const three = require.resolve("three").split(`${sep}build${sep}`)[0];

const page = `<!doctype html><meta charset="utf-8">
<style>body{margin:0;background:#fff} #names div{position:absolute;font:13px sans-serif;color:#111;
text-shadow:0 0 3px #fff,0 0 3px #fff,0 0 3px #fff;transform:translate(-50%,-50%);white-space:nowrap}</style>
<canvas id="c" width="760" height="520"></canvas><div id="names"></div>
<script type="importmap">{"imports":{"three":"/three/build/three.module.js","three/addons/":"/three/examples/jsm/"}}</script>
<script type="module">
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
const canvas = document.getElementById("c");
const renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
renderer.setClearColor(0xffffff);
const faint = (name) => name.includes("insulated") || /^(open space|cover)/.test(name);
window.load = async (file) => {
  const begin = performance.now();
  const gltf = await new GLTFLoader().loadAsync("/scene/" + file);
  const scene = new THREE.Scene();
  scene.add(gltf.scene, new THREE.HemisphereLight(0xffffff, 0x909090, 2.2));
  const sun = new THREE.DirectionalLight(0xffffff, 1.8);
  sun.position.set(2, 5, 3);
  scene.add(sun);
  const mixer = new THREE.AnimationMixer(gltf.scene);
  const clip = gltf.animations[0];
  if (clip) mixer.clipAction(clip).setLoop(THREE.LoopOnce).play();
  window.state = { gltf, scene, mixer, clip };
  return performance.now() - begin;
};
window.draw = (last) => {
  const { gltf, scene, mixer, clip } = window.state;
  // Just before the end, where no action is over yet.
  if (clip) mixer.setTime(last ? clip.duration - 1e-4 : 0);
  if (clip && last) for (const action of mixer._actions) { action.time = clip.duration; action.paused = true; mixer.update(0); }
  scene.updateMatrixWorld(true);
  const all = new THREE.Box3();
  const shown = [];
  gltf.scene.traverse((node) => {
    if (!node.isMesh || node.matrixWorld.determinant() === 0) return;
    const own = new THREE.Box3().setFromObject(node, true);
    if (!faint(node.userData.name ?? node.name)) all.union(own);
    shown.push([node, own]);
  });
  const middle = all.getCenter(new THREE.Vector3());
  const radius = all.getSize(new THREE.Vector3()).length() / 2;
  const camera = new THREE.PerspectiveCamera(28, canvas.width / canvas.height, radius / 50, radius * 50);
  camera.position.copy(middle).add(new THREE.Vector3(0.62, 0.42, 1).normalize().multiplyScalar(radius * 3.6));
  camera.lookAt(middle);
  renderer.render(scene, camera);
  const names = document.getElementById("names");
  names.replaceChildren();
  const taken = [];
  for (const [node, own] of shown) {
    const name = node.userData.name ?? node.name;
    if (/^(wall|walls|open space)|part /.test(name)) continue;
    const at = own.getCenter(new THREE.Vector3());
    if (/^(layer|substrate|cover|indenter|board)/.test(name)) at.x = own.max.x, at.z = own.max.z;
    at.project(camera);
    let [x, y] = [(0.5 + 0.5 * at.x) * canvas.width, (0.5 - 0.5 * at.y) * canvas.height];
    if (name.startsWith("scale bar")) y += 14;
    x = Math.min(Math.max(x, 60), canvas.width - 60);
    while (taken.some(([a, b]) => Math.abs(a - x) < 110 && Math.abs(b - y) < 15)) y += 4;
    taken.push([x, y]);
    const label = document.createElement("div");
    label.textContent = name.replaceAll("_", " ");
    label.style.left = x + "px";
    label.style.top = y + "px";
    names.append(label);
  }
  return { bodies: shown.length, animated: Boolean(clip) };
};
window.ready = true;
</script>`;

const server = createServer(async (request, response) => {
  try {
    const path = decodeURIComponent(request.url);
    if (path === "/") return response.setHeader("content-type", "text/html").end(page);
    if (path.startsWith("/scene/")) return response.end(await readFile(scenes[Number(path.slice(7))][0]));
    if (!path.startsWith("/three/") || path.includes("..")) return response.writeHead(404).end();
    response.setHeader("content-type", "text/javascript");
    response.end(await readFile(join(three, path.slice(7))));
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((done) => server.listen(0, "127.0.0.1", done));
const browser = await puppeteer.launch({
  executablePath: process.env.CHROMIUM ?? (await chromium.executablePath()),
  args: [...chromium.args, "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
  headless: "shell",
});
const tab = await browser.newPage();
tab.on("console", (message) => console.error(message.text()));
tab.on("pageerror", (error) => console.error(String(error)));
await tab.setViewport({ width: 760, height: 520 });
await tab.goto(`http://127.0.0.1:${server.address().port}/`);
await tab.waitForFunction("window.ready");
for (const [k, [, name]] of scenes.entries()) {
  const milliseconds = await tab.evaluate((file) => window.load(file), k);
  const first = await tab.evaluate(() => window.draw(false));
  await writeFile(join(out, `${name}-first.png`), await tab.screenshot());
  if (first.animated) {
    await tab.evaluate(() => window.draw(true));
    await writeFile(join(out, `${name}-last.png`), await tab.screenshot());
  }
  console.log(`${name}: ${first.bodies} bodies, loaded in ${milliseconds.toFixed(0)} ms`);
}
await browser.close();
server.close();
