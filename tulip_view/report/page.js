// The report's page: draws the figures, plays the replay, and moves one cursor through all diagrams of time.
"use strict";
const content = JSON.parse(document.getElementById("content").textContent);
const timePlots = [];
let now = null;

function floats(base64) {
  const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

// Figures -------------------------------------------------------------------------------------------------------------
const settings = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["lasso2d", "select2d"] };
let sharing = false, shownRange = null;

function drawFigure(key) {
  const figure = content.figures[key];
  const plot = document.getElementById("figure-" + key);
  if (figure.time && shownRange !== null) figure.layout.xaxis.range = shownRange;
  if (figure.layout.yaxis.scaleanchor) {  // no empty space above and below on a narrow page
    figure.layout.height = Math.min(figure.layout.height, 0.75 * plot.clientWidth + 140);
    plot.style.height = figure.layout.height + "px";
  }
  Plotly.newPlot(plot, figure.traces, figure.layout, settings);
  plot.dataset.drawn = "yes";
  if (!figure.time) return;
  const cursor = document.createElement("div");
  cursor.className = "cursor";
  plot.appendChild(cursor);
  timePlots.push({ plot, cursor });
  plot.on("plotly_click", (event) => showTime(Number(event.points[0].x)));
  plot.on("plotly_relayout", (change) => { shareRange(plot, change); placeCursors(); });
  plot.on("plotly_afterplot", placeCursors);
}

// All diagrams of time show the same piece of it.
function shareRange(source, change) {
  if (sharing) return;
  const [begin, end] = change["xaxis.range"] || [change["xaxis.range[0]"], change["xaxis.range[1]"]];
  const all = change["xaxis.autorange"] === true;
  if (begin === undefined && !all) return;
  sharing = true;
  shownRange = all ? null : [begin, end];
  const wanted = all ? { "xaxis.autorange": true } : { "xaxis.range": [begin, end] };
  Promise.all(timePlots.filter((each) => each.plot !== source).map((each) => Plotly.relayout(each.plot, wanted)))
    .finally(() => { sharing = false; placeCursors(); });
}

function placeCursors() {
  for (const { plot, cursor } of timePlots) {
    const layout = plot._fullLayout;
    if (now === null || !layout || !layout.xaxis) { cursor.style.display = "none"; continue; }
    const x = layout.xaxis.l2p(now), size = layout._size;
    const inside = x >= 0 && x <= layout.xaxis._length;
    cursor.style.display = inside ? "block" : "none";
    cursor.style.left = (layout.xaxis._offset + x) + "px";
    cursor.style.top = size.t + "px";
    cursor.style.height = (layout.height - size.t - size.b) + "px";
  }
}

// Figures are drawn when they come near the window: the page opens at once.
const watcher = new IntersectionObserver((entries) => {
  for (const entry of entries) {
    if (!entry.isIntersecting || entry.target.dataset.drawn) continue;
    watcher.unobserve(entry.target);
    drawFigure(entry.target.id.slice("figure-".length));
  }
}, { rootMargin: "600px" });
document.querySelectorAll(".plot").forEach((plot) => watcher.observe(plot));

document.querySelectorAll("select.choice").forEach((chooser) => chooser.addEventListener("change", () => {
  document.getElementById(chooser.dataset.section).querySelectorAll(".plot").forEach((plot) => {
    const figure = content.figures[plot.id.slice("figure-".length)];
    const visible = figure.traces.map((trace) => trace.meta === undefined || trace.meta === chooser.value);
    figure.traces.forEach((trace, index) => { trace.visible = visible[index]; });
    if (plot.dataset.drawn) Plotly.restyle(plot, { visible });
  });
}));

document.querySelectorAll("[data-time]").forEach((each) =>
  each.addEventListener("click", () => showTime(Number(each.dataset.time))));

// Replay --------------------------------------------------------------------------------------------------------------
// links: frames x links x 7 (position, quaternion x, y, z, w); ball, ball_belief: frames x 3; other, belief:
// frames x 3 (x, y, yaw); boxes: {link, size, centre, colour}. NaN where nothing is known.
const replay = content.replay;
const scene = document.getElementById("stage");
const faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
  [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]];
let player = null;

function corners(box) {
  const found = [];
  for (const x of [-0.5, 0.5]) for (const y of [-0.5, 0.5]) for (const z of [-0.5, 0.5])
    found.push([box.centre[0] + x * box.size[0], box.centre[1] + y * box.size[1], box.centre[2] + z * box.size[2]]);
  return found;
}

function turned(p, at) {  // a point by position and quaternion
  const [px, py, pz, x, y, z, w] = at;
  const tx = 2 * (y * p[2] - z * p[1]), ty = 2 * (z * p[0] - x * p[2]), tz = 2 * (x * p[1] - y * p[0]);
  return [px + p[0] + w * tx + y * tz - z * ty, py + p[1] + w * ty + z * tx - x * tz, pz + p[2] + w * tz + x * ty - y * tx];
}

function mesh(boxes) {
  const i = [], j = [], k = [], facecolor = [];
  boxes.forEach((box, number) => faces.forEach((face) => {
    i.push(8 * number + face[0]); j.push(8 * number + face[1]); k.push(8 * number + face[2]);
    facecolor.push(box.colour);
  }));
  return { type: "mesh3d", i, j, k, facecolor, x: [], y: [], z: [], flatshading: true, hoverinfo: "skip",
    lighting: { ambient: 0.55, diffuse: 0.7, specular: 0.05, facenormalsepsilon: 0 }, lightposition: { x: 100, y: -200, z: 400 } };
}

function globe(radius, rings = 8, parts = 12) {
  const points = [], i = [], j = [], k = [];
  for (let ring = 0; ring <= rings; ring++) for (let part = 0; part < parts; part++) {
    const up = Math.PI * ring / rings, round = 2 * Math.PI * part / parts;
    points.push([radius * Math.sin(up) * Math.cos(round), radius * Math.sin(up) * Math.sin(round), radius * Math.cos(up)]);
    if (ring < rings) {
      const a = ring * parts + part, b = ring * parts + (part + 1) % parts;
      i.push(a, b); j.push(a + parts, a + parts); k.push(b, b + parts);
    }
  }
  return { points, i, j, k };
}

function makeReplay() {
  const times = floats(replay.times), links = floats(replay.links), count = links.length / times.length / 7;
  const ball = floats(replay.ball), other = floats(replay.other);
  const belief = floats(replay.belief), ballBelief = floats(replay.ball_belief);
  const own = replay.boxes.map(corners), others = (replay.other_boxes || []).map(corners);
  const sphere = globe(replay.radius);
  const traces = [];
  for (const line of replay.ground) {
    const x = Array.from(floats(line.x)), y = Array.from(floats(line.y));
    if (line.fill) {
      traces.push({ type: "mesh3d", x: x.slice(0, 4), y: y.slice(0, 4), z: [-0.006, -0.006, -0.006, -0.006], i: [0, 0], j: [1, 2],
        k: [2, 3], color: line.colour, hoverinfo: "skip", lighting: { ambient: 1, diffuse: 0, specular: 0 } });
    } else {
      traces.push({ type: "scatter3d", mode: "lines", x, y, z: x.map(() => 0), hoverinfo: "skip",
        line: { color: line.colour, width: 4 } });
    }
  }
  for (const goal of replay.goals) traces.push({ type: "scatter3d", mode: "lines", hoverinfo: "skip",
    x: [goal.x, goal.x, goal.x, goal.x], y: [goal.left, goal.left, goal.right, goal.right],
    z: [0, goal.height, goal.height, 0], line: { color: "#ffe14d", width: 9 } });
  const first = traces.length;
  traces.push(mesh(replay.boxes), mesh(replay.other_boxes || []),
    { type: "mesh3d", i: sphere.i, j: sphere.j, k: sphere.k, x: [], y: [], z: [], color: "#ff7f0e", hoverinfo: "skip" },
    { type: "scatter3d", mode: "lines", x: [], y: [], z: [], line: { color: "#0072b2", width: 7 }, hoverinfo: "skip" },
    { type: "scatter3d", mode: "markers", x: [], y: [], z: [], hoverinfo: "skip",
      marker: { size: 9, color: "rgba(213,94,0,0)", line: { color: "#d62728", width: 4 }, symbol: "circle-open" } });
  const [reachX, reachY] = replay.reach, high = 1.6;
  const hidden = { visible: false, showspikes: false };
  const camera = { eye: { x: -0.45, y: -0.5, z: 0.3 }, center: { x: 0, y: 0, z: -0.05 }, up: { x: 0, y: 0, z: 1 } };
  const layout = { margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: false, height: 520, uirevision: "stay",
    paper_bgcolor: "#dce6ef", scene: { dragmode: "orbit", camera,
      xaxis: { ...hidden, range: [-reachX, reachX], autorange: false }, yaxis: { ...hidden, range: [-reachY, reachY], autorange: false },
      zaxis: { ...hidden, range: [-0.01, high], autorange: false },
      aspectmode: "manual", aspectratio: { x: 4, y: 4 * reachY / reachX, z: 2 * high / reachX } } };
  const numbers = [0, 1, 2, 3, 4].map((each) => first + each);
  const slider = document.getElementById("slider");
  slider.max = times.length - 1;

  function shape(frame) {
    const x = [[], [], [], [], []], y = [[], [], [], [], []], z = [[], [], [], [], []];
    const add = (which, point) => { x[which].push(point[0]); y[which].push(point[1]); z[which].push(point[2]); };
    replay.boxes.forEach((box, number) => {
      const at = links.subarray((frame * count + box.link) * 7, (frame * count + box.link) * 7 + 7);
      for (const corner of own[number]) add(0, turned(corner, at));
    });
    const [ox, oy, yaw] = other.subarray(3 * frame, 3 * frame + 3);
    for (const box of others) for (const c of box) add(1, Number.isNaN(ox) ? [NaN, NaN, NaN] :
      [ox + Math.cos(yaw) * c[0] - Math.sin(yaw) * c[1], oy + Math.sin(yaw) * c[0] + Math.cos(yaw) * c[1], c[2]]);
    const b = ball.subarray(3 * frame, 3 * frame + 3);
    for (const point of sphere.points) add(2, [b[0] + point[0], b[1] + point[1], b[2] + point[2]]);
    const [ex, ey, eyaw] = belief.subarray(3 * frame, 3 * frame + 3);
    const place = (ahead, aside) => [ex + ahead * Math.cos(eyaw) - aside * Math.sin(eyaw),
      ey + ahead * Math.sin(eyaw) + aside * Math.cos(eyaw), 0.01];
    for (const [ahead, aside] of [[0, 0], [0.5, 0], [0.4, 0.08], [0.5, 0], [0.4, -0.08]]) add(3, place(ahead, aside));
    add(4, ballBelief.subarray(3 * frame, 3 * frame + 3));
    return { x, y, z };
  }

  // The camera keeps its place beside the robot: its middle moves, and its eye with it.
  function follow(frame, change) {
    const at = links.subarray(frame * count * 7, frame * count * 7 + 3);
    if (Number.isNaN(at[0])) return change;
    const scale = 2 / reachX;  // aspectratio per metre; the scene's middle is its origin
    const middle = { x: at[0] * scale, y: at[1] * scale, z: (at[2] * 0.6 - high / 2) * scale };
    const present = scene._fullLayout.scene._scene ? scene._fullLayout.scene._scene.getCamera() : camera;
    const shift = { x: middle.x - present.center.x, y: middle.y - present.center.y, z: middle.z - present.center.z };
    change["scene.camera"] = { up: present.up, center: middle,
      eye: { x: present.eye.x + shift.x, y: present.eye.y + shift.y, z: present.eye.z + shift.z },
      projection: present.projection };
    return change;
  }

  let drawing = false, wantedFrame = null;
  function show(frame) {
    wantedFrame = frame;
    if (drawing) return;
    drawing = true;
    const layoutChange = document.getElementById("follow").checked ? follow(frame, {}) : {};
    Plotly.update(scene, shape(frame), layoutChange, numbers).finally(() => {
      drawing = false;
      if (wantedFrame !== frame) show(wantedFrame);
    });
  }

  let playing = false, begun = 0, begunAt = 0;
  const button = document.getElementById("play"), speed = document.getElementById("speed");
  function step(clock) {
    if (!playing) return;
    const time = begunAt + (clock - begun) / 1000 * Number(speed.value);
    if (time >= times[times.length - 1]) { stop(); showTime(times[times.length - 1]); return; }
    showTime(time);
    requestAnimationFrame(step);
  }
  function start() {
    playing = true;
    button.textContent = "Pause";
    begunAt = now === null || now >= times[times.length - 1] ? times[0] : now;
    begun = performance.now();
    requestAnimationFrame(step);
  }
  function stop() { playing = false; button.textContent = "Play"; }
  button.addEventListener("click", () => playing ? stop() : start());
  speed.addEventListener("change", () => { if (playing) { stop(); start(); } });
  slider.addEventListener("input", () => { stop(); showTime(times[Number(slider.value)]); });

  return Plotly.newPlot(scene, traces, layout, settings).then(() => ({
    frameAt: (time) => Math.max(0, Math.min(times.length - 1, Math.round((time - times[0]) * replay.rate))),
    show, slider, first: times[0],
  }));
}

let shown = -1;
function showTime(time) {
  now = time;
  placeCursors();
  const output = document.getElementById("now");
  if (output) output.textContent = time.toFixed(2) + " s";
  if (!player) return;
  const frame = player.frameAt(time);
  player.slider.value = frame;
  if (frame !== shown) { shown = frame; player.show(frame); }
}

if (replay && scene) {
  makeReplay().then((made) => { player = made; showTime(made.first); })
    .catch((error) => { scene.textContent = "The replay needs WebGL, which this browser does not offer: " + error; });
}
window.addEventListener("resize", () => setTimeout(placeCursors, 300));
