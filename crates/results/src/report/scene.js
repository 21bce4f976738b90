// The 3D view: bodies as boxes or meshes at each load step, and interpolated between the steps.
"use strict";
(async () => {
  const scene = elastocap.data.scene;
  const view = document.querySelector(".view"), note = document.getElementById("no-view");
  if (!scene || !view) return;
  const canvas = document.getElementById("scene");
  let packedMeshes = document.getElementById("meshes").textContent.trim(), meshBytes, renderer;
  try {
    const context = document.createElement("canvas").getContext("webgl2");
    if (!context) throw new Error("this browser has no WebGL");
    context.getExtension("WEBGL_lose_context")?.loseContext();
    const code = new TextDecoder().decode(await elastocap.unpack(document.getElementById("three").textContent));
    // A classic script, so that it works from disk; it makes the global name THREE.
    const script = document.createElement("script");
    script.textContent = code;
    document.head.append(script);
    if (packedMeshes) meshBytes = (await elastocap.unpack(packedMeshes)).buffer;
    renderer = new THREE.WebGLRenderer({ canvas, antialias: false, alpha: true });
  } catch (error) {
    note.textContent = `No 3D view: ${error.message}. scene.glb holds the same for any glTF viewer.`;
    return;
  }
  packedMeshes = null;
  view.hidden = false;
  note.hidden = true;

  // The colour and the opacity of bodies. As in scene.glb, metal is opaque, and bodies around it are see-through.
  const DRIVEN = ["#d55e00", "#f0d020", "#8050b0", "#3d4650", "#b8527e", "#7a4310", "#f2b48c"];
  const FLOATING = ["#007a58", "#6cb03f", "#0b4a2f"];
  const DIELECTRIC = ["#c6b5e0", "#bfd8a8", "#f0c2d0", "#a8bce8", "#e0d3a8"];
  const LOOKS = {
    grounded: ["#8a8a8a", 1], layer: ["#56b4e9", 0.28], substrate: ["#b8a07a", 0.5], cover: ["#d8dce0", 0.08],
    wall: ["#9aa0a8", 0.08], "grounded-wall": ["#5a6470", 0.2], surroundings: ["#c4d8ec", 0.05], indenter: ["#707883", 0.45], scale: ["#808890", 1],
  };
  const counts = {}, given = new Map();
  function look(body) {
    const palette = { conductor: DRIVEN, floating: FLOATING, dielectric: DIELECTRIC }[body.role];
    if (!palette) return LOOKS[body.role] && covered(body).length ? [LOOKS[body.role][0], 0.4] : (LOOKS[body.role] ?? ["#888888", 1]);
    const name = owner(body.name);
    if (!given.has(name)) given.set(name, palette[(counts[body.role] = (counts[body.role] ?? -1) + 1) % palette.length]);
    return [given.get(name), body.role === "dielectric" ? 0.35 : 1];
  }
  const metal = new Set(["conductor", "floating", "grounded"]);
  /** The conductors that a grounded one would hide from above: those that lie below it, within its outline. */
  function covered(body) {
    if (body.role !== "grounded" || !body.poses) return [];
    const [x, , z, toX, , toZ] = body.poses[0];
    const isBelow = ({ poses: [[x0, , z0, x1, top, z1]] }) => top <= body.poses[0][1] && x <= x0 && x1 <= toX && z <= z0 && z1 <= toZ;
    return scene.bodies.filter((other) => other !== body && other.poses && metal.has(other.role) && isBelow(other)).map((other) => owner(other.name));
  }
  /** The name of the body that a part belongs to. */
  const owner = (name) => name.split(", part ")[0].replace(/'+$/, "");

  // Coordinates in the view are relative to the middle of the scene, over its largest extent.
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const grow = (min, max) => min.forEach((x, a) => ((low[a] = Math.min(low[a], x)), (high[a] = Math.max(high[a], max[a]))));
  const faint = new Set(["wall", "grounded-wall", "surroundings", "cover"]);
  const solid = scene.bodies.filter((b) => !faint.has(b.role));
  for (const body of solid.length ? solid : scene.bodies) {
    for (const pose of body.poses ?? []) grow(pose.slice(0, 3), pose.slice(3));
    for (const mesh of (body.meshes ?? []).filter(Boolean)) grow(mesh.min, mesh.min.map((x, a) => x + mesh.size[a]));
  }
  const size = Math.max(...high.map((x, a) => x - low[a])) || 1, middle = low.map((x, a) => (x + high[a]) / 2);
  const place = (x, a) => (x - middle[a]) / size;

  const world = new THREE.Scene();
  world.add(new THREE.AmbientLight(0xffffff, 1.7));
  for (const [x, y, z, strength] of [[2, 4, 3, 1.6], [-3, 1, -2, 0.6]]) {
    const light = new THREE.DirectionalLight(0xffffff, strength);
    light.position.set(x, y, z);
    world.add(light);
  }

  const CUBE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
  const SIDES = [0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 3, 6, 2, 3, 7, 6, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5];
  const EDGES = [0, 1, 1, 2, 2, 3, 3, 0, 4, 5, 5, 6, 6, 7, 7, 4, 0, 4, 1, 5, 2, 6, 3, 7];
  const corners = (pose) => new Float32Array(CUBE.flatMap((c) => c.map((upper, a) => place(pose[upper ? a + 3 : a], a))));
  const mixed = (from, to, t, into) => {
    for (let i = 0; i < into.length; i++) into[i] = from[i] + t * (to[i] - from[i]);
  };

  const lines = [];
  function lineMaterial(colour, clear) {
    const material = new THREE.LineBasicMaterial({ transparent: true, opacity: clear ? 0.5 : 0.8 });
    lines.push([material, colour]);
    return material;
  }
  /** The sides of triangles at which a surface ends or turns by more than 25 degrees, as pairs of points. */
  function creases(points, indices) {
    const sides = new Map(), found = [];
    const at = (n) => new THREE.Vector3(points[3 * n], points[3 * n + 1], points[3 * n + 2]);
    for (let k = 0; k < indices.length; k += 3) {
      const [a, b, c] = [at(indices[k]), at(indices[k + 1]), at(indices[k + 2])];
      const normal = b.sub(a).cross(c.sub(a)).normalize();
      for (let j = 0; j < 3; j++) {
        const p = indices[k + j], q = indices[k + ((j + 1) % 3)], key = p < q ? `${p} ${q}` : `${q} ${p}`;
        const other = sides.get(key);
        if (!other) sides.set(key, { p, q, normal });
        else {
          if (Math.abs(other.normal.dot(normal)) < 0.9) found.push(p, q);
          other.paired = true;
        }
      }
    }
    for (const { p, q, paired } of sides.values()) if (!paired) found.push(p, q);
    return found;
  }
  /** New corners for triangles: neighbours share theirs only where the surface turns by less than 25 degrees between them, so that round bodies are
      shaded smoothly and edges stay sharp. `corners` has three for each triangle, `from` the number of the point at which each of them is. */
  function smoothed(points, indices) {
    const at = (n) => new THREE.Vector3(points[3 * n], points[3 * n + 1], points[3 * n + 2]);
    const parent = Uint32Array.from(indices, (_, k) => k), sides = new Map(), normals = [];
    const root = (k) => {
      while (parent[k] !== k) k = parent[k] = parent[parent[k]];
      return k;
    };
    for (let k = 0; k < indices.length; k += 3) {
      const [a, b, c] = [at(indices[k]), at(indices[k + 1]), at(indices[k + 2])];
      normals.push(b.sub(a).cross(c.sub(a)).normalize());
      for (let j = 0; j < 3; j++) {
        const m = k + j, n = k + ((j + 1) % 3), p = indices[m], q = indices[n], key = p < q ? `${p} ${q}` : `${q} ${p}`;
        const other = sides.get(key);
        if (!other) sides.set(key, [m, n]);
        else if (normals[k / 3].dot(normals[Math.floor(other[0] / 3)]) > 0.9) {
          for (const here of [m, n]) for (const there of other) if (indices[here] === indices[there]) parent[root(here)] = root(there);
        }
      }
    }
    const numbers = new Map(), from = [];
    const corners = Uint32Array.from(indices, (point, k) => {
      const corner = root(k);
      if (!numbers.has(corner)) {
        numbers.set(corner, from.length);
        from.push(point);
      }
      return numbers.get(corner);
    });
    return { corners, from };
  }
  const around = new Set(["layer", "dielectric", "substrate"]);
  const lowest = (body) => (body.poses ? body.poses[0][1] : body.meshes.find(Boolean).min[1]);
  const upward = [...scene.bodies].sort((a, b) => lowest(a) - lowest(b));
  /** The position of a body in the order of drawing: first see-through bodies that hold metal, then metal, then the indenter, then walls and what else
      surrounds the scene; within each group from the lowest to the highest. A fixed order keeps faces in one plane from flickering. */
  function turn(body, clear) {
    const stage = !clear ? 1 : faint.has(body.role) ? 3 : around.has(body.role) ? 0 : 2;
    return stage + upward.indexOf(body) / (scene.bodies.length + 1);
  }
  /** A body as an object of the view; `put(step, t)` gives it its shape at the fraction `t` of the way from a step to the next. */
  function built(body, number) {
    const [colour, opacity] = look(body);
    const clear = opacity < 1;
    // Every material counts as transparent: only transparent objects are all drawn in the order of `renderOrder`.
    const material = new THREE.MeshLambertMaterial({
      color: colour, opacity, transparent: true, depthWrite: !clear, side: 2, flatShading: !!body.poses, polygonOffset: true,
      polygonOffsetFactor: clear ? 2 : 1, polygonOffsetUnits: 1 + 2 * number,
    });
    const mesh = new THREE.Mesh(new THREE.BufferGeometry(), material);
    mesh.frustumCulled = false;
    mesh.renderOrder = turn(body, clear);
    const group = new THREE.Group();
    group.add(mesh);
    const positions = (array) => new THREE.BufferAttribute(array, 3);
    if (body.poses) {
      const states = body.poses.map(corners), now = new Float32Array(states[0]);
      const shared = positions(now);
      mesh.geometry.setAttribute("position", shared).setIndex(SIDES);
      const edges = new THREE.LineSegments(new THREE.BufferGeometry().setAttribute("position", shared).setIndex(EDGES), lineMaterial(colour, clear));
      edges.frustumCulled = false;
      edges.renderOrder = 4;
      group.add(edges);
      return { group, body, put(step, t) {
        if (states.length === 1) return;
        mixed(states[step], states[Math.min(step + 1, states.length - 1)], t, now);
        shared.needsUpdate = true;
      } };
    }
    const states = body.meshes.map((own) => {
      if (!own) return null;
      const packed = new Uint16Array(meshBytes, own.points[0], 3 * own.points[1]);
      const points = Float32Array.from(packed, (x, i) => place(own.min[i % 3] + (own.size[i % 3] * x) / 65535, i % 3));
      return { points, at: own.triangles[0], indices: new Uint32Array(meshBytes, own.triangles[0], 3 * own.triangles[1]) };
    });
    const edges = new THREE.LineSegments(new THREE.BufferGeometry(), lineMaterial(colour, clear));
    edges.frustumCulled = false;
    edges.renderOrder = 4;
    group.add(edges);
    let shown = null, shared = null, faces = null, smooth = null;
    return { group, body, put(step, t) {
      const from = states[step], to = states[Math.min(step + 1, states.length - 1)];
      const own = from ?? to;
      group.userData.missing = !from && !(t > 0.5 && to);
      if (!own) return;
      const same = from && to && from.at === to.at && from.points.length === to.points.length;
      const state = same ? from : t > 0.5 && to ? to : own;
      if (shown?.at !== state.at || shared?.count !== state.points.length / 3) {
        shared = positions(new Float32Array(state.points));
        state.creases ??= creases(state.points, state.indices);
        smooth = smoothed(state.points, state.indices);
        faces = positions(new Float32Array(3 * smooth.from.length));
        mesh.geometry.deleteAttribute("normal");
        mesh.geometry.setAttribute("position", faces).setIndex(new THREE.BufferAttribute(smooth.corners, 1));
        edges.geometry.setAttribute("position", shared).setIndex(state.creases);
      }
      shown = state;
      if (same) mixed(from.points, to.points, t, shared.array);
      else shared.array.set(state.points);
      shared.needsUpdate = true;
      smooth.from.forEach((n, k) => faces.array.set(shared.array.subarray(3 * n, 3 * n + 3), 3 * k));
      faces.needsUpdate = true;
      mesh.geometry.computeVertexNormals();
    } };
  }
  const bodies = scene.bodies.map(built);
  bodies.forEach((own) => world.add(own.group));

  // The list of bodies to show or hide: one entry for each body, or for each kind of body where there are many.
  const box = document.getElementById("bodies");
  const names = new Set(bodies.map((own) => owner(own.body.name)));
  const listed = names.size <= 40;
  const key = (own) => (listed ? owner(own.body.name) : own.body.role);
  const hidden = new Set(), seeThrough = [];
  for (const name of new Set(bodies.map(key))) {
    const own = bodies.filter((b) => key(b) === name);
    const label = document.createElement("label"), check = document.createElement("input"), chip = document.createElement("i");
    check.type = "checkbox";
    check.checked = !faint.has(own[0].body.role);
    if (!check.checked) hidden.add(name);
    chip.style.background = look(own[0].body)[0];
    const below = new Set(own.flatMap((one) => covered(one.body)));
    if (below.size) seeThrough.push(`${name} is drawn see-through, since it lies over ${[...below].join(", ")}.`);
    label.append(check, chip, name + (listed ? "" : ` (${own.length})`));
    check.addEventListener("change", () => {
      if (check.checked) hidden.delete(name);
      else hidden.add(name);
      render();
    });
    box.append(label);
  }
  const told = [...(hidden.size ? [`Hidden at first: ${[...hidden].join(", ")}.`] : []), ...seeThrough, ...(scene.notes ?? [])];
  const remark = document.getElementById("view-notes");
  remark.textContent = told.join(" ");
  remark.hidden = !told.length;

  const camera = new THREE.PerspectiveCamera(32, 1, 0.01, 50);
  const controls = new THREE.OrbitControls(camera, canvas);
  controls.enableDamping = false;
  controls.zoomSpeed = 0.8;
  controls.minDistance = 0.3;
  controls.maxDistance = 12;
  const ends = CUBE.map((c) => new THREE.Vector3(...c.map((upper, a) => place(upper ? high[a] : low[a], a))));
  /** Looks at the whole from the front, as near as it fits. */
  function home() {
    const from = new THREE.Vector3(0.5, 0.46, 0.73).normalize(), target = new THREE.Vector3();
    let far = 2;
    for (let k = 0; k < 6; k++) {
      camera.position.copy(target).addScaledVector(from, far);
      camera.lookAt(target);
      camera.updateMatrixWorld();
      const shown = ends.map((p) => p.clone().project(camera));
      const [left, right] = [Math.min(...shown.map((p) => p.x)), Math.max(...shown.map((p) => p.x))];
      const [lower, upper] = [Math.min(...shown.map((p) => p.y)), Math.max(...shown.map((p) => p.y))];
      const high = far * Math.tan((camera.fov * Math.PI) / 360);
      const across = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 0), up = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 1);
      target.addScaledVector(across, (high * camera.aspect * (left + right)) / 2).addScaledVector(up, (high * (lower + upper)) / 2);
      far *= Math.max((right - left) / 2, (upper - lower) / 2) / 0.9;
    }
    camera.position.copy(target).addScaledVector(from, far);
    controls.target.copy(target);
    controls.update();
    render();
  }

  let step = 0, frames = 0, asked = false, rest = null;
  const last = scene.labels.length - 1;
  // A moving picture is drawn in fewer pixels where drawing is slow; a still one in twice as many as the screen has, which smooths its edges.
  const SHARES = [1, 0.75, 0.55, 0.4, 0.3];
  let share = 0, before = 0, slow = 0;
  /** Chooses the share of pixels by the mean time between pictures. */
  function adapt(now) {
    const took = now - before;
    before = now;
    if (took > 400) return;
    slow = 0.8 * slow + 0.2 * took;
    if (slow > 28 && share < SHARES.length - 1) {
      share++;
      slow = 20;
    } else if (slow < 17.5 && share > 0) {
      share--;
      slow = 20;
    }
  }
  function draw(ratio) {
    const at = Math.min(last, Math.max(0, step)), whole = Math.min(Math.floor(at), Math.max(0, last - 1)), t = at - whole;
    for (const own of bodies) {
      own.put(whole, t);
      own.group.visible = !hidden.has(key(own)) && !own.group.userData.missing;
    }
    if (renderer.getPixelRatio() !== ratio) renderer.setPixelRatio(ratio);
    renderer.render(world, camera);
  }
  const still = () => Math.min(2 * devicePixelRatio, 3);
  function drawMoving(now) {
    adapt(now);
    draw(SHARES[share] * Math.min(devicePixelRatio, 1.5));
    canvas.dataset.frames = String(++frames);
    clearTimeout(rest);
    rest = setTimeout(() => draw(still()), 250);
  }
  function render() {
    if (asked) return;
    asked = true;
    requestAnimationFrame((now) => {
      asked = false;
      drawMoving(now);
    });
  }
  controls.addEventListener("change", render);

  const slider = document.getElementById("step"), output = document.getElementById("step-label"), play = document.getElementById("play");
  function say() {
    if (!slider) return;
    const index = Math.round(Math.min(last, step)), text = `${index}: ${scene.labels[index]}`;
    if (output.textContent === text) return;
    output.textContent = text;
    slider.setAttribute("aria-valuetext", text);
  }
  let playing = null;
  function stop() {
    if (playing !== null) cancelAnimationFrame(playing);
    playing = null;
    play.textContent = "Play the load";
    play.setAttribute("aria-pressed", "false");
  }
  if (slider) {
    slider.addEventListener("input", () => {
      stop();
      step = Number(slider.value);
      say();
      render();
    });
    // The arrow keys go from step to step; the pointer also goes to states in between.
    slider.addEventListener("keydown", (event) => {
      const to = { ArrowRight: Math.floor(step + 1), ArrowUp: Math.floor(step + 1), ArrowLeft: Math.ceil(step - 1), ArrowDown: Math.ceil(step - 1), Home: 0, End: last }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      stop();
      step = Math.min(last, Math.max(0, to));
      slider.value = step;
      say();
      render();
    });
    play.addEventListener("click", () => {
      if (playing !== null) return stop();
      play.textContent = "Pause";
      play.setAttribute("aria-pressed", "true");
      if (step >= last) step = 0;
      let reached = step, start = performance.now();
      const seconds = Math.min(8, Math.max(2.5, 0.9 * last));
      const frame = (now) => {
        reached += (Math.max(0, now - start) / 1000 / seconds) * last;
        start = now;
        // The last step stays for a moment; then the load begins again.
        if (reached > last * 1.15) reached = 0;
        step = Math.min(reached, last);
        slider.value = step;
        say();
        drawMoving(now);
        playing = requestAnimationFrame(frame);
      };
      playing = requestAnimationFrame(frame);
    });
    say();
  }
  document.getElementById("home").addEventListener("click", home);
  canvas.addEventListener("keydown", (event) => {
    const turn = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
    const zoom = { "+": 0.9, "=": 0.9, "-": 1 / 0.9, "\u2212": 1 / 0.9 }[event.key];
    if (!turn && !zoom && event.key !== "0") return;
    event.preventDefault();
    if (event.key === "0") return home();
    const around = new THREE.Spherical().setFromVector3(camera.position.clone().sub(controls.target));
    if (turn) {
      around.theta += turn[0];
      around.phi = Math.min(3.1, Math.max(0.04, around.phi + turn[1]));
    }
    if (zoom) around.radius = Math.min(12, Math.max(0.3, around.radius * zoom));
    camera.position.setFromSpherical(around).add(controls.target);
    controls.update();
    render();
  });

  function themed() {
    const ink = new THREE.Color(elastocap.isDark() ? "#f0f4fa" : "#1c2430");
    lines.forEach(([material, colour]) => material.color.set(colour).lerp(ink, 0.55));
    render();
  }
  elastocap.onTheme(themed);
  function fit() {
    const { clientWidth: width, clientHeight: height } = canvas;
    if (!width || !height) return;
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    render();
  }
  new ResizeObserver(fit).observe(canvas);
  // Paper gets the picture as it stands.
  const picture = document.getElementById("scene-print");
  addEventListener("beforeprint", () => {
    draw(still());
    picture.src = canvas.toDataURL("image/png");
    picture.hidden = false;
  });
  addEventListener("afterprint", () => (picture.hidden = true));
  fit();
  themed();
  home();
  canvas.dataset.ready = "true";
})();
