// The viewer of a replay page: draws the run, plays it, and draws the signals below in step.
// In: the JSON `header`, the packed `numbers` and three.js, all in the page (mjchair/report/replay).
// Out: window.mjchair with `ready` (a promise) and `pose(time, body)`, see the end of this file.
(() => {
  "use strict";
  const $ = (id) => document.getElementById(id);
  const page = JSON.parse($("header").textContent);
  const LIFT = 0.006; // m, of the path above the ground
  const WIDTH = 0.025; // m, of the path
  const AXIS = 46; // pixels left of a diagram, for its numbers
  let arrays = null;

  // ---- numbers -----------------------------------------------------------------------------

  const KINDS = { float32: Float32Array, uint32: Uint32Array, uint16: Uint16Array, int16: Int16Array, int8: Int8Array };

  // The bytes of a compressed text of the page.
  async function inflated(id) {
    const text = atob($(id).textContent.trim());
    const packed = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) packed[i] = text.charCodeAt(i);
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // Put three.js in place, which is in the page as a compressed text.
  async function loadThree() {
    const script = document.createElement("script");
    script.textContent = new TextDecoder().decode(await inflated("three")) + "\nwindow.THREE = THREE;";
    document.head.append(script);
  }

  // The arrays of the page by name, as {rows, columns, values}; values column after column.
  async function unpack() {
    const raw = await inflated("numbers");
    const unpacked = {};
    let start = 0;
    for (const { name, kind, shape } of page.blocks) {
      const [rows, columns = 1] = shape;
      const size = KINDS[kind].BYTES_PER_ELEMENT, count = rows * columns;
      const bytes = new Uint8Array(count * size);
      for (let b = 0; b < size; b++)
        for (let i = 0, from = start + b * count; i < count; i++) bytes[i * size + b] = raw[from + i];
      start += count * size;
      unpacked[name] = { rows, columns, values: new KINDS[kind](bytes.buffer) };
    }
    return unpacked;
  }

  const column = (array, c) => array.values.subarray(c * array.rows, (c + 1) * array.rows);

  // ---- poses -------------------------------------------------------------------------------

  // The sample before a time, and the share of the way to the next one.
  function moment(times, time) {
    let low = 0, high = times.length - 1;
    if (!(time > times[0])) return [0, 0];
    if (time >= times[high]) return [high, 0];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle; else high = middle;
    }
    return [low, (time - times[low]) / (times[high] - times[low])];
  }

  // Place and quaternion (w first) of a body: a straight line and an even turn between samples.
  function poseAt(number, body, k, share) {
    const places = arrays[`track${number}.places`], turns = arrays[`track${number}.quaternions`];
    const n = places.rows, out = new Array(7);
    const next = share > 0 ? k + 1 : k;
    for (let i = 0; i < 3; i++) {
      const from = (3 * body + i) * n, a = places.values[from + k];
      out[i] = a + share * (places.values[from + next] - a);
    }
    let cosine = 0;
    for (let i = 0; i < 4; i++) {
      const from = (4 * body + i) * n;
      cosine += turns.values[from + k] * turns.values[from + next];
    }
    const angle = Math.acos(Math.min(1, Math.abs(cosine))), sine = Math.sin(angle);
    const a = sine < 1e-4 ? 1 - share : Math.sin((1 - share) * angle) / sine;
    const b = (sine < 1e-4 ? share : Math.sin(share * angle) / sine) * (cosine < 0 ? -1 : 1);
    let length = 0;
    for (let i = 0; i < 4; i++) {
      const from = (4 * body + i) * n;
      out[3 + i] = a * turns.values[from + k] + b * turns.values[from + next];
      length += out[3 + i] ** 2;
    }
    for (let i = 3; i < 7; i++) out[i] /= Math.sqrt(length);
    return out;
  }

  const bodiesOf = (number) => page.models[page.tracks[number].model].bodies;
  const timesOf = (number) => arrays[`track${number}.time`].values;

  // ---- the scene ---------------------------------------------------------------------------

  // Whether the browser draws; asked before THREE is, which would report a failure as an error.
  function draws() {
    try { return !!document.createElement("canvas").getContext("webgl2"); } catch { return false; }
  }

  // Geometry of a simple shape, long axis along z as MuJoCo has it.
  function solidGeometry(solid) {
    const [x, y, z] = solid.size;
    if (solid.kind === "box") return new THREE.BoxGeometry(2 * x, 2 * y, 2 * z);
    if (solid.kind === "ellipsoid") return new THREE.SphereGeometry(1, 24, 16).scale(x, y, z);
    if (solid.kind === "cylinder") return new THREE.CylinderGeometry(x, x, 2 * y, 28).rotateX(Math.PI / 2);
    return new THREE.CapsuleGeometry(x, 2 * y, 6, 16).rotateX(Math.PI / 2);
  }

  const quaternion = ([w, x, y, z]) => new THREE.Quaternion(x, y, z, w);

  function placed(solid) {
    return new THREE.Matrix4().compose(
      new THREE.Vector3(...solid.place), quaternion(solid.quaternion), new THREE.Vector3(1, 1, 1));
  }

  // All parts of one body that are equally opaque, as one geometry with a colour at each vertex.
  function merged(parts) {
    const positions = [], normals = [], colours = [], index = [];
    for (const { position, normal, triangles, colour } of parts) {
      const first = positions.length / 3, c = new THREE.Color().setRGB(colour[0], colour[1], colour[2], THREE.SRGBColorSpace);
      for (const v of position) positions.push(v);
      for (const v of normal) normals.push(v);
      for (let i = 0; i < position.length; i += 3) colours.push(c.r, c.g, c.b);
      for (const v of triangles) index.push(first + v);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(positions), 3));
    geometry.setAttribute("normal", new THREE.BufferAttribute(new Float32Array(normals), 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(colours), 3));
    geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(index), 1));
    return geometry;
  }

  // The parts of every body of a model: body -> list of {position, normal, triangles, colour}.
  function partsOf(m) {
    const model = page.models[m], parts = model.bodies.map(() => []);
    model.surfaces.forEach((surface, s) => {
      const name = `model${m}.surface${s}`, range = arrays[`${name}.range`];
      const vertices = arrays[`${name}.vertices`], normals = arrays[`${name}.normals`];
      const triangles = arrays[`${name}.triangles`], n = vertices.rows;
      const position = new Float32Array(3 * n), normal = new Float32Array(3 * n);
      for (let c = 0; c < 3; c++) {
        const low = range.values[2 * c], step = (range.values[2 * c + 1] - low) / 65535;
        for (let i = 0; i < n; i++) {
          position[3 * i + c] = low + step * vertices.values[c * n + i];
          normal[3 * i + c] = normals.values[c * n + i] / 127;
        }
      }
      const corners = new Uint32Array(triangles.values.length);
      for (let c = 0; c < 3; c++)
        for (let i = 0; i < triangles.rows; i++) corners[3 * i + c] = triangles.values[c * triangles.rows + i];
      parts[surface.body].push({ position, normal, triangles: corners, colour: surface.colour });
    });
    for (const solid of model.solids) {
      if (solid.kind === "plane") continue;
      const g = solidGeometry(solid).applyMatrix4(placed(solid));
      parts[solid.body].push({ position: g.attributes.position.array, normal: g.attributes.normal.array,
        triangles: g.index.array, colour: solid.colour });
    }
    return parts;
  }

  // A picture of floor tiles: 2 x 2 squares of 1 m with fine lines between them.
  function tiles() {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 256;
    const draw = canvas.getContext("2d");
    draw.fillStyle = "#c9ced2"; draw.fillRect(0, 0, 256, 256);
    draw.fillStyle = "#c1c7cc"; draw.fillRect(0, 0, 128, 128); draw.fillRect(128, 128, 128, 128);
    draw.fillStyle = "#aab2b8";
    for (const at of [0, 128]) { draw.fillRect(at, 0, 1.5, 256); draw.fillRect(0, at, 256, 1.5); }
    const texture = new THREE.CanvasTexture(canvas);
    texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
    texture.colorSpace = THREE.SRGBColorSpace;
    texture.anisotropy = 8;
    return texture;
  }

  // A plane geom: as large as it says, or far beyond the run where it is endless.
  function plane(solid, middle) {
    const far = 400, width = 2 * solid.size[0] || far, depth = 2 * solid.size[1] || far;
    const texture = tiles();
    texture.repeat.set(width / 2, depth / 2);
    const geometry = new THREE.PlaneGeometry(width, depth);
    const mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ map: texture }));
    mesh.applyMatrix4(placed(solid));
    // from below, as where a platform tilts away from the camera, the chair is seen through it
    mesh.add(new THREE.Mesh(geometry.clone().rotateX(Math.PI), new THREE.MeshBasicMaterial(
      { map: texture, transparent: true, opacity: 0.3, depthWrite: false })));
    if (!solid.size[0] && !solid.size[1]) {
      // an endless plane is moved in whole pairs of tiles, so that its pattern stays in place
      const local = new THREE.Vector3(...middle).applyMatrix4(placed(solid).invert());
      mesh.translateX(2 * Math.round(local.x / 2)); mesh.translateY(2 * Math.round(local.y / 2));
    }
    mesh.receiveShadow = true;
    return mesh;
  }

  // A flat band along a path on the ground.
  function band(path, colour, opacity) {
    const n = path.rows, position = new Float32Array(6 * n), index = [];
    const at = (k, c) => path.values[c * n + k];
    let side = [0, 1];
    for (let k = 0; k < n; k++) {
      const a = Math.max(0, k - 1), b = Math.min(n - 1, k + 1);
      const dx = at(b, 0) - at(a, 0), dy = at(b, 1) - at(a, 1), length = Math.hypot(dx, dy);
      if (length > 1e-4) side = [-dy / length, dx / length];
      for (const [s, sign] of [[0, -1], [1, 1]]) {
        position[6 * k + 3 * s] = at(k, 0) + sign * 0.5 * WIDTH * side[0];
        position[6 * k + 3 * s + 1] = at(k, 1) + sign * 0.5 * WIDTH * side[1];
        position[6 * k + 3 * s + 2] = at(k, 2) + LIFT;
      }
      if (k) index.push(2 * k - 2, 2 * k - 1, 2 * k, 2 * k, 2 * k - 1, 2 * k + 1);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
    geometry.setIndex(index);
    const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial(
      { color: colour, transparent: true, opacity, side: THREE.DoubleSide, depthWrite: false }));
    mesh.frustumCulled = false;
    return mesh;
  }

  // An arrow of unit direction y, whose length is set by `aim`.
  class Arrow {
    constructor(colour) {
      const material = new THREE.MeshBasicMaterial({ color: colour });
      this.shaft = new THREE.Mesh(Arrow.shaft ??= new THREE.CylinderGeometry(0.012, 0.012, 1, 12).translate(0, 0.5, 0), material);
      this.head = new THREE.Mesh(Arrow.head ??= new THREE.CylinderGeometry(0, 0.03, 0.08, 14).translate(0, 0.04, 0), material);
      this.group = new THREE.Group();
      this.group.add(this.shaft, this.head);
    }
    aim(start, vector) {
      const length = vector.length();
      this.group.visible = length >= 0.02;
      if (!this.group.visible) return;
      const head = Math.min(0.08, 0.6 * length);
      this.head.scale.setScalar(head / 0.08);
      this.head.position.y = length - head;
      this.shaft.scale.set(1, length - head, 1);
      this.group.position.copy(start);
      this.group.quaternion.setFromUnitVectors(Arrow.up ??= new THREE.Vector3(0, 1, 0), vector.divideScalar(length));
    }
  }

  // One chair that moves: its bodies, its path and its arrows.
  class Chair {
    constructor(number, parts) {
      this.number = number;
      this.track = page.tracks[number];
      this.times = timesOf(number);
      this.path = arrays[`track${number}.path`];
      this.group = new THREE.Group();
      this.bodies = bodiesOf(number).map((_, b) => this.body(parts[b], b));
      this.bodies.forEach((body) => this.group.add(body));
      const colour = this.track.colour;
      this.paths = new THREE.Group();
      this.whole = band(this.path, colour, 0.25);
      this.past = band(this.path, colour, 0.9);
      this.paths.add(this.whole, this.past);
      this.forces = new THREE.Group();
      this.arrows = {};
      for (const wheel of Object.keys(this.track.contacts)) {
        this.arrows[wheel] = {};
        for (const component of Object.keys(page.forces)) {
          const arrow = (this.arrows[wheel][component] = new Arrow(page.forces[component].colour));
          arrow.component = component;
          this.forces.add(arrow.group);
        }
      }
    }

    body(parts, b) {
      const group = new THREE.Group();
      if (b === 0 && this.number > 0) return group; // the ground is drawn once
      for (const opaque of [true, false]) {
        const chosen = parts.filter((p) => (p.colour[3] >= 1) === opaque);
        if (!chosen.length) continue;
        const ghost = this.number > 0, geometry = merged(chosen);
        const material = ghost
          ? new THREE.MeshLambertMaterial({ color: this.track.colour, transparent: true, opacity: 0.45 })
          : new THREE.MeshLambertMaterial({ vertexColors: true, transparent: !opaque,
              opacity: opaque ? 1 : Math.min(...chosen.map((p) => p.colour[3])) });
        const mesh = new THREE.Mesh(geometry, material);
        mesh.castShadow = !ghost && opaque && b > 0;
        mesh.receiveShadow = !ghost;
        mesh.renderOrder = ghost ? 2 : 0;
        group.add(mesh);
        if (!ghost) continue;
        // its depth first, so that a ghost shows its outside only
        const depth = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ colorWrite: false, transparent: true }));
        depth.renderOrder = 1;
        group.add(depth);
      }
      return group;
    }

    middle(k, share) {
      const next = share > 0 ? k + 1 : k, n = this.path.rows;
      return new THREE.Vector3(...[0, 1, 2].map((c) => {
        const a = this.path.values[c * n + k];
        return a + share * (this.path.values[c * n + next] - a);
      }));
    }

    show(time) {
      const [k, share] = moment(this.times, time);
      this.bodies.forEach((body, b) => {
        const [x, y, z, qw, qx, qy, qz] = poseAt(this.number, b, k, share);
        body.position.set(x, y, z);
        body.quaternion.set(qx, qy, qz, qw);
      });
      this.past.geometry.setDrawRange(0, 6 * k);
      const sample = share < 0.5 ? k : k + 1, middle = this.middle(k, share);
      for (const wheel of Object.keys(this.arrows)) this.aim(wheel, sample, middle);
      return middle;
    }

    aim(wheel, k, middle) {
      const contact = arrays[`track${this.number}.contact.${wheel}`];
      const v = (c) => new THREE.Vector3(...[c, c + 1, c + 2].map((i) => contact.values[i * contact.rows + k]));
      const place = v(0), normal = v(3), forward = v(6), left = normal.clone().cross(forward);
      const axes = { longitudinal: forward, lateral: left, load: normal };
      const outward = left.clone().multiplyScalar(place.clone().sub(middle).dot(left) > 0 ? 0.1 : -0.1);
      const start = place.clone().add(outward).addScaledVector(normal, 0.02);
      for (const [component, arrow] of Object.entries(this.arrows[wheel])) {
        const force = forceAt(this.number, wheel, component, k);
        const length = Math.min(Math.abs(force) / page.forces[component].scale, page.longest) * Math.sign(force);
        if (Number.isFinite(length * place.x)) arrow.aim(start, axes[component].clone().multiplyScalar(length));
        else arrow.group.visible = false;
      }
    }
  }

  function signal(number, name) {
    const at = page.tracks[number].signals.indexOf(name);
    return at < 0 ? null : column(arrays[`track${number}.signals`], at);
  }

  function forceAt(number, wheel, component, k) {
    const values = signal(number, page.tracks[number].contacts[wheel][component]);
    return values ? values[k] : 0;
  }

  // Direction of gravity, 1, world.
  function downAt(time) {
    const [k, share] = moment(timesOf(0), time), next = share > 0 ? k + 1 : k;
    const at = (i) => new THREE.Vector3(...[0, 1, 2].map((c) => arrays.down.values[c * arrays.down.rows + i]));
    return at(k).lerp(at(next), share).normalize();
  }

  class Stage {
    constructor(canvas) {
      this.canvas = canvas;
      this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
      this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
      this.renderer.shadowMap.enabled = true;
      this.scene = new THREE.Scene();
      this.scene.background = new THREE.Color("#dfe5ea");
      this.scene.fog = new THREE.Fog("#dfe5ea", 25, 120);
      this.scene.add(new THREE.HemisphereLight("#ffffff", "#8a9096", 1.9));
      this.light = new THREE.DirectionalLight("#ffffff", 2.1);
      this.light.castShadow = true;
      this.light.shadow.mapSize.set(1024, 1024);
      this.light.shadow.bias = -0.001;
      this.light.shadow.normalBias = 0.01;
      Object.assign(this.light.shadow.camera, { left: -2, right: 2, top: 2, bottom: -2, near: 0.5, far: 12 });
      this.scene.add(this.light, this.light.target);
      const parts = page.models.map((_, m) => partsOf(m));
      this.chairs = page.tracks.map((track, number) => new Chair(number, parts[track.model]));
      this.world = new THREE.Group();
      for (const chair of this.chairs) this.world.add(chair.group, chair.paths, chair.forces);
      this.scene.add(this.world);
      const start = this.chairs[0].middle(0, 0);
      for (const solid of page.models[page.tracks[0].model].solids)
        if (solid.kind === "plane") this.chairs[0].bodies[solid.body].add(plane(solid, start.toArray()));
      this.camera = new THREE.PerspectiveCamera(38, 1, 0.05, 500);
      this.camera.up.set(0, 0, 1);
      this.orbit = new THREE.OrbitControls(this.camera, canvas);
      this.orbit.addEventListener("change", () => { this.dirty = true; });
      this.orbit.maxDistance = 150;
      this.dirty = true;
      this.show(0);
      this.look("follow");
    }

    // Move the chairs to a time, and the camera along with the first of them.
    show(time) {
      let middle = null;
      for (const chair of this.chairs) { const at = chair.show(time); middle ??= at; }
      middle.z += 0.4;
      this.standUpright(middle, downAt(time));
      if (this.middle && this.mode !== "orbit") {
        const moved = middle.clone().sub(this.middle);
        this.camera.position.add(moved);
        this.orbit.target.add(moved);
      }
      this.middle = middle;
      this.light.position.copy(middle).add(new THREE.Vector3(1.8, 1.2, 4.5));
      this.light.target.position.copy(middle);
      this.dirty = true;
    }

    // Turn the world about a point until gravity points down in the picture: a floor that tilts
    // under gravity, or gravity that leans, is then seen as a tilted floor.
    standUpright(about, down) {
      this.world.quaternion.setFromUnitVectors(down.negate(), this.camera.up);
      this.world.position.copy(about).sub(about.clone().applyQuaternion(this.world.quaternion));
      this.world.updateMatrixWorld();
    }

    // Column and row of the picture, pixels, where a point of the world, m, is drawn.
    pixel(point) {
      this.camera.updateMatrixWorld();
      const seen = new THREE.Vector3(...point).applyMatrix4(this.world.matrixWorld).project(this.camera);
      return [0.5 * (1 + seen.x) * this.canvas.clientWidth, 0.5 * (1 - seen.y) * this.canvas.clientHeight];
    }

    // follow: beside the chair and along with it; orbit: stays where it is; top: from above.
    look(mode) {
      const before = this.mode;
      this.mode = mode;
      this.orbit.enableRotate = mode !== "top";
      if (mode === "top") {
        this.orbit.target.copy(this.middle);
        this.camera.position.copy(this.middle).add(new THREE.Vector3(0, -0.001, 6));
      } else if (before !== "orbit" && before !== "follow" || mode === "follow") {
        const angle = page.view.azimuth, up = page.view.elevation, away = page.view.distance;
        this.orbit.target.copy(this.middle);
        this.camera.position.copy(this.middle).add(new THREE.Vector3(
          away * Math.cos(up) * Math.cos(angle), away * Math.cos(up) * Math.sin(angle), away * Math.sin(up)));
      }
      this.orbit.update();
      this.dirty = true;
    }

    draw() {
      const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
      if (width !== this.width || height !== this.height) {
        [this.width, this.height] = [width, height];
        this.renderer.setSize(width, height, false);
        this.camera.aspect = width / Math.max(height, 1);
        this.camera.updateProjectionMatrix();
        this.dirty = true;
      }
      this.orbit.update();
      if (this.dirty && width && height) this.renderer.render(this.scene, this.camera);
      this.dirty = false;
    }
  }

  // ---- signals -----------------------------------------------------------------------------

  const short = (value) => (!Number.isFinite(value) ? "–"
    : value && Math.abs(value) < 1e-3 ? (+value.toPrecision(2)).toExponential() : String(+value.toPrecision(4)));

  // Values at which lines of a diagram are drawn: about so many, at round numbers.
  function rounds(low, high, about = 3) {
    const rough = 0.999 * (high - low) / about, power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find((s) => s * power >= rough);
    const values = [];
    for (let v = Math.ceil(low / step) * step; v <= high; v += step) values.push(+v.toPrecision(10));
    return values;
  }

  class Panel {
    constructor(group, player) {
      this.group = group;
      this.player = player;
      this.lines = [];
      page.tracks.forEach((track, number) => group.signals.forEach((name, s) => {
        const values = signal(number, name);
        if (values) this.lines.push({ number, name, values, times: timesOf(number), colour: group.colours[s], dashed: number > 0 });
      }));
      this.element = document.createElement("div");
      this.element.className = "panel";
      this.head = document.createElement("p");
      const box = document.createElement("div");
      box.className = "box";
      this.base = document.createElement("canvas");
      this.top = document.createElement("canvas");
      box.append(this.base, this.top);
      this.element.append(this.head, box);
      const title = document.createElement("b");
      title.textContent = group.unit ? `${group.title} (${group.unit})` : group.title;
      this.head.append(title);
      for (const line of this.lines) {
        const item = document.createElement("span"), swatch = document.createElement("span");
        swatch.className = line.dashed ? "swatch dashed" : "swatch";
        swatch.style.background = swatch.style.borderColor = line.colour;
        line.value = document.createElement("span");
        const label = group.labels[group.signals.indexOf(line.name)];
        const of = page.tracks.length > 1 ? [page.tracks[line.number].label, label].filter(Boolean).join(", ") : label;
        item.append(swatch, of ? of + " " : "", line.value);
        this.head.append(item);
      }
      const timeAt = (event) => {
        const r = this.top.getBoundingClientRect();
        const share = (event.clientX - r.left - AXIS) / Math.max(1, r.width - AXIS - 4);
        return player.begin + Math.min(1, Math.max(0, share)) * (player.end - player.begin);
      };
      box.addEventListener("pointerdown", (event) => { this.held = true; box.setPointerCapture(event.pointerId); player.pause(); player.seek(timeAt(event)); });
      box.addEventListener("pointermove", (event) => { if (this.held) player.seek(timeAt(event)); player.hover(timeAt(event)); });
      for (const kind of ["pointerup", "pointercancel"]) box.addEventListener(kind, () => { this.held = false; });
      box.addEventListener("pointerleave", () => player.hover(null));
    }

    // The diagram without the mark of the time; a line is drawn from least to largest of a column.
    drawBase() {
      const ratio = Math.min(window.devicePixelRatio || 1, 2), width = this.base.clientWidth, height = this.base.clientHeight;
      for (const canvas of [this.base, this.top]) { canvas.width = width * ratio; canvas.height = height * ratio; }
      const draw = this.base.getContext("2d");
      draw.scale(ratio, ratio);
      let low = Infinity, high = -Infinity;
      for (const { values } of this.lines) for (const v of values) { if (v < low) low = v; if (v > high) high = v; }
      if (!(high >= low)) [low, high] = [-1, 1];
      const margin = 0.06 * (high - low) || 0.1 * Math.abs(high) || 1;
      [low, high] = [low - margin, high + margin];
      const bottom = height - 16;
      const y = (v) => bottom - ((v - low) / (high - low)) * (bottom - 4), x = (t) => this.across(t);
      draw.font = "11px system-ui, sans-serif";
      draw.fillStyle = "#444"; draw.strokeStyle = "#dde2e6"; draw.lineWidth = 1;
      draw.textAlign = "right"; draw.textBaseline = "middle";
      for (const v of rounds(low, high)) {
        draw.beginPath(); draw.moveTo(AXIS, y(v)); draw.lineTo(width - 4, y(v)); draw.stroke();
        draw.fillText(short(v), AXIS - 5, y(v));
      }
      draw.textAlign = "center"; draw.textBaseline = "bottom";
      const seconds = rounds(this.player.begin, this.player.end + 1e-9, 5);
      for (const t of seconds) draw.fillText(`${short(t)} s`, Math.min(Math.max(x(t), AXIS + 8), width - 18), height);
      for (const line of this.lines) this.drawLine(draw, line, x, y);
    }

    drawLine(draw, { values, times, colour, dashed }, x, y) {
      draw.strokeStyle = colour; draw.lineWidth = 1.4; draw.lineJoin = "round";
      draw.setLineDash(dashed ? [5, 4] : []);
      draw.beginPath();
      let open = false;
      const step = times.length > 4 * this.base.clientWidth ? Math.floor(times.length / (2 * this.base.clientWidth)) : 1;
      for (let k = 0; k < times.length; k += step) {
        let least = k, most = k;
        for (let i = k; i < Math.min(k + step, times.length); i++) {
          if (values[i] < values[least]) least = i;
          if (values[i] > values[most]) most = i;
        }
        for (const i of least < most ? [least, most] : least > most ? [most, least] : [k]) {
          if (!Number.isFinite(values[i])) { open = step > 1 && open; continue; }
          if (open) draw.lineTo(x(times[i]), y(values[i])); else draw.moveTo(x(times[i]), y(values[i]));
          open = true;
        }
      }
      draw.stroke();
      draw.setLineDash([]);
    }

    across(time) {
      const { begin, end } = this.player;
      return AXIS + ((time - begin) / Math.max(end - begin, 1e-9)) * (this.base.clientWidth - AXIS - 4);
    }

    // The mark of the time that is shown, that under the pointer, and the values there.
    mark(time, hovered) {
      if (this.base.clientWidth !== this.width) { this.width = this.base.clientWidth; this.drawBase(); }
      const draw = this.top.getContext("2d"), ratio = this.top.width / Math.max(1, this.base.clientWidth);
      draw.setTransform(ratio, 0, 0, ratio, 0, 0);
      draw.clearRect(0, 0, this.base.clientWidth, this.base.clientHeight);
      for (const [at, colour] of [[hovered, "#9aa7b5"], [time, "#222"]]) {
        if (at === null) continue;
        draw.strokeStyle = colour;
        draw.beginPath(); draw.moveTo(this.across(at), 2); draw.lineTo(this.across(at), this.base.clientHeight - 16); draw.stroke();
      }
      for (const line of this.lines) {
        const [k, share] = moment(line.times, hovered ?? time);
        line.value.textContent = short(line.values[share < 0.5 ? k : k + 1]);
      }
    }
  }

  // ---- playing -----------------------------------------------------------------------------

  class Player {
    constructor(stage) {
      this.stage = stage;
      const all = page.tracks.map((_, number) => timesOf(number));
      this.begin = Math.min(...all.map((t) => t[0]));
      this.end = Math.max(...all.map((t) => t[t.length - 1]));
      this.time = timesOf(0)[0];
      this.speed = 1;
      this.playing = false;
      this.hovered = null;
      this.panels = [];
      this.changed = true;
      $("scrub").min = this.begin; $("scrub").max = this.end;
      this.buildShown();
      this.buildForces();
      this.buildChoices();
      this.listen();
      const tick = (now) => { this.tick(now); window.requestAnimationFrame(tick); };
      window.requestAnimationFrame(tick);
    }

    tick(now) {
      const passed = Math.min(0.1, (now - (this.last ?? now)) / 1000);
      this.last = now;
      if (this.playing) {
        const time = this.time + passed * this.speed;
        if (time >= this.end) this.pause();
        this.seek(Math.min(time, this.end));
      }
      this.refresh();
    }

    // Draw what has changed.
    refresh() {
      if (this.changed) {
        if (this.stage) this.stage.show(this.time);
        $("scrub").value = this.time;
        $("clock").textContent = `${this.time.toFixed(2)} / ${this.end.toFixed(2)} s`;
        this.writeForces();
      }
      if (this.changed || this.marked || window.innerWidth !== this.width) {
        this.width = window.innerWidth;
        for (const panel of this.panels) panel.mark(this.time, this.hovered);
      }
      this.changed = this.marked = false;
      if (this.stage) this.stage.draw();
    }

    seek(time) { this.time = Math.min(this.end, Math.max(this.begin, time)); this.changed = true; }
    hover(time) { this.hovered = time; this.marked = true; }
    pause() { this.playing = false; this.button(); }
    play() { if (this.time >= this.end) this.seek(this.begin); this.playing = true; this.button(); }
    toggle() { if (this.playing) this.pause(); else this.play(); }
    button() {
      $("play").textContent = this.playing ? "\u275A\u275A" : "\u25B6";
      $("play").setAttribute("aria-label", this.playing ? "Pause" : "Play");
    }

    look(mode) {
      if (!this.stage) return;
      this.stage.look(mode);
      for (const b of document.querySelectorAll("#cameras button")) b.setAttribute("aria-pressed", String(b.dataset.camera === mode));
    }

    // The table of the forces: a row for each component with its switch and scale, a column for each wheel.
    buildForces() {
      const wheels = Object.keys(page.tracks[0].contacts);
      if (!wheels.length || !this.stage) return;
      this.stage.chairs.forEach((chair, number) => { chair.forces.visible = number === 0; });
      const table = document.createElement("table"), head = table.insertRow();
      for (const title of ["force (N)", "arrow", ...wheels.map((wheel) => wheel.replaceAll("_", " "))]) {
        const cell = document.createElement("th");
        cell.textContent = title;
        head.append(cell);
      }
      this.forceBoxes = [];
      this.forceCells = Object.entries(page.forces).map(([component, force]) => {
        const row = table.insertRow();
        this.forceBoxes.push(this.box(row.insertCell(), component, force.colour, (on) => {
          for (const chair of this.stage.chairs)
            for (const arrows of Object.values(chair.arrows)) arrows[component].group.children.forEach((mesh) => { mesh.visible = on; });
        }));
        row.insertCell().textContent = `${force.scale} N/m`;
        return [component, wheels.map((wheel) => [wheel, row.insertCell()])];
      });
      $("forces").append(table);
    }

    writeForces() {
      const [k, share] = moment(timesOf(0), this.time), sample = share < 0.5 ? k : k + 1;
      for (const [component, cells] of this.forceCells ?? [])
        for (const [wheel, cell] of cells) cell.textContent = String(Math.round(forceAt(0, wheel, component, sample)) || 0);
    }

    // A box that switches something in the scene on and off; it is on at first.
    box(parent, label, colour, set) {
      const element = document.createElement("label"), box = document.createElement("input");
      box.type = "checkbox"; box.checked = true;
      const apply = () => { set(box.checked); this.stage.dirty = true; };
      box.addEventListener("change", apply);
      element.append(box);
      if (colour) { const s = document.createElement("span"); s.className = "swatch"; s.style.background = colour; element.append(s); }
      element.append(" " + label);
      parent.append(element);
      apply();
      return box;
    }

    // Boxes that show and hide chairs and paths.
    buildShown() {
      if (!this.stage) return;
      page.tracks.forEach((track, number) => {
        if (page.tracks.length > 1) this.box($("shown"), track.label, track.colour, (on) => {
          const chair = this.stage.chairs[number];
          chair.bodies.forEach((body, b) => { if (b > 0) body.visible = on; });
          chair.hidden = !on; chair.forces.visible = on && number === 0; chair.paths.visible = on && this.pathShown !== false;
        });
      });
      this.box($("shown"), "path", null, (on) => { this.pathShown = on; for (const chair of this.stage.chairs) chair.paths.visible = on && !chair.hidden; });
    }

    buildChoices() {
      page.panels.forEach((group) => {
        const panel = new Panel(group, this);
        if (!panel.lines.length) return;
        const label = document.createElement("label"), box = document.createElement("input");
        box.type = "checkbox"; box.checked = group.shown;
        const set = () => {
          panel.element.hidden = !box.checked;
          this.panels = this.panels.filter((p) => p !== panel);
          if (box.checked) { panel.width = null; this.panels.push(panel); this.marked = true; }
        };
        box.addEventListener("change", set);
        label.append(box, " " + panel.head.querySelector("b").textContent);
        $("choices").append(label);
        $("signals").append(panel.element);
        set();
      });
    }

    listen() {
      $("play").addEventListener("click", () => this.toggle());
      $("scrub").addEventListener("input", () => { this.pause(); this.seek(+$("scrub").value); });
      $("speed").addEventListener("change", () => { this.speed = +$("speed").value; });
      for (const b of document.querySelectorAll("#cameras button")) b.addEventListener("click", () => this.look(b.dataset.camera));
      const faster = (by) => {
        const s = $("speed");
        s.selectedIndex = Math.min(s.options.length - 1, Math.max(0, s.selectedIndex + by));
        this.speed = +s.value;
      };
      const keys = {
        " ": () => this.toggle(),
        ArrowLeft: (e) => this.step(-1, e.shiftKey), ArrowRight: (e) => this.step(1, e.shiftKey),
        Home: () => this.seek(this.begin), End: () => this.seek(this.end),
        1: () => this.look("follow"), 2: () => this.look("orbit"), 3: () => this.look("top"),
        "+": () => faster(1), "=": () => faster(1), "-": () => faster(-1),
        f: () => { const on = this.forceBoxes?.some((b) => b.checked); for (const b of this.forceBoxes ?? []) if (b.checked === on) b.click(); },
      };
      document.addEventListener("keydown", (event) => {
        const typed = event.target.tagName === "SELECT" || (event.target.type === "checkbox" && event.key === " ");
        if (typed || event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
        event.preventDefault();
        keys[event.key](event);
      });
    }

    // One sample of the first chair, or one second.
    step(sign, whole) {
      this.pause();
      if (whole) return this.seek(this.time + sign);
      const times = timesOf(0), [k, share] = moment(times, this.time + 1e-9);
      const to = sign > 0 ? k + 1 : share > 1e-6 ? k : k - 1;
      this.seek(times[Math.min(times.length - 1, Math.max(0, to))]);
    }
  }

  // ---- the door to outside -----------------------------------------------------------------

  function bodyNumber(track, body) {
    const names = bodiesOf(track), number = typeof body === "number" ? body : names.indexOf(body);
    if (!(number >= 0 && number < names.length)) throw new Error(`no body ${body}; there are ${names.join(", ")}`);
    return number;
  }

  // ready: a promise, kept when the page can be used.
  // pose(time, body, track = 0): [x, y, z, qw, qx, qy, qz], m, world, of a body by name or number.
  // pixel(point): column and row, pixels, where a point of the world (m) is drawn in the picture.
  // bodies, tracks: names. seek(time), play(), pause(), look(mode): as the controls do. time: shown, s.
  let player = null;
  window.mjchair = {
    pose(time, body, track = 0) {
      const number = bodyNumber(track, body), [k, share] = moment(timesOf(track), time);
      return poseAt(track, number, k, share);
    },
    pixel(point) { return player.stage.pixel(point); },
    bodies: bodiesOf(0),
    tracks: page.tracks.map((t) => t.label),
    seek(time) { player.pause(); player.seek(time); player.refresh(); },
    play() { player.play(); },
    pause() { player.pause(); },
    look(mode) { player.look(mode); },
    get time() { return player.time; },
    get drawn() { return !!player.stage; },
  };

  // A page that shows this one in a frame has the same door, unless it has one already.
  try { if (window.parent !== window) window.parent.mjchair ??= window.mjchair; } catch { /* another origin */ }

  async function begin() {
    if (typeof DecompressionStream === "undefined") {
      $("notice").textContent = "This picture stands still: the browser is too old to unpack the run.";
      throw new Error("no DecompressionStream");
    }
    arrays = await unpack();
    let stage = null;
    if (draws()) {
      $("scene").hidden = false;
      $("still").hidden = $("notice").hidden = true;
      await loadThree();
      stage = new Stage($("scene"));
    } else {
      $("notice").textContent = "This picture stands still: the browser draws nothing in three dimensions (no WebGL). The signals below work.";
      $("cameras").hidden = $("forces").hidden = true;
    }
    player = new Player(stage);
    player.look("follow");
    player.refresh();
  }
  window.mjchair.ready = begin();
  window.mjchair.ready.catch(() => {});
})();
