// The live page: one socket, whose messages are put into the page as text, never as markup.
import { CameraView } from "./camera.js";
import { colourOf, css } from "./colours.js";
import { nonce, proof } from "./proof.js";
import { WorldView } from "./world.js";

const $ = (id) => document.getElementById(id);
const RETRY_MS = 1000, QUIET_S = 3, CONFIRM_MS = 1000, OLD_IMAGE_MS = 2000, NO_STATUS_S = 3, PROOF_MS = 5000;

const given = document.querySelector("meta[name=paramove-key]").content;
if (given) localStorage.setItem("paramove-key", given);
let key = given || localStorage.getItem("paramove-key") || ""; // of the page's present process; useless after its end
let nextKey = ""; // of the process that may follow; never stored, as a foreign program at this port could read it there
history.replaceState(null, "", "/"); // the token is used up

const state = {};
const camera = new CameraView($("camera"));
const world = new WorldView($("world"), $("labels"));
let socket = null, image = null, connected = false, ended = "", quietS = 0, pressedAt = null, everConnected = false, foreign = false;

function text(element, value) {
  if (element.textContent !== value) element.textContent = value;
}

function cell(row, value, name = "") {
  const made = row.insertCell();
  made.textContent = value;
  if (name) made.className = name;
  return made;
}

const pair = (position) => position.slice(0, 2).map((value) => (100 * value).toFixed(1).replace("-", "−")).join(", ");
const cm = (position) => `${pair(position)} cm`;

const SHOW = {
  page(content) {
    text($("title"), content.title);
    document.title = `${content.title} – paramove`;
    document.body.classList.toggle("without-robot", !content.robot);
    text($("belongs"), content.belongs);
    $("stages").replaceChildren(...content.stages.map((stage) => {
      const item = document.createElement("li");
      item.textContent = stage[0].toUpperCase() + stage.slice(1);
      return item;
    }));
    SHOW.stage(state.stage ?? {});
    showRules(state.objects ?? {});
  },
  stage(content) {
    const stages = state.page?.stages ?? [], now = stages.indexOf(content.stage), last = stages.length - 1;
    $("stages").querySelectorAll("li").forEach((item, index) => {
      item.className = index < now || (index === now && now === last) ? "past" : index === now ? "now" : "";
      if (index === now) item.setAttribute("aria-current", "step"); else item.removeAttribute("aria-current");
    });
    text($("step"), content.step ?? "");
    text($("counts"), content.grasps === undefined ? "" : `${content.grasps} ${content.grasps === 1 ? "grasp" : "grasps"}, ${content.retries} repeated`);
  },
  clock(content) {
    text($("clock"), `${Math.floor(content / 60)}:${String(Math.floor(content % 60)).padStart(2, "0")}`);
  },
  words(content) { if (content.length) text($("sentence"), content.at(-1).sentence); },
  action(content) { if (content && !state.words?.length) text($("sentence"), content); },
  objects(content) { showRules(content); },
  pointed() { showRules(state.objects ?? {}); },
  goal(content) {
    const { kind, object, to, from } = content;
    text($("goal"), kind ? [kind, object].filter(Boolean).join(" ") : "nothing yet");
    const path = from && to ? `${pair(from)} → ${cm(to)}` : to ? `→ ${cm(to)}` : "";
    const progress = content.ended ? content.state : [content.phase || content.state, content.attempt > 1 ? `attempt ${content.attempt}` : ""].filter(Boolean).join(", ");
    text($("phase"), [progress, path].filter(Boolean).join("  ·  "));
  },
  results(content) {
    $("results").replaceChildren(...content.toReversed().map((result) => {
      const item = document.createElement("li"), more = document.createElement("small");
      if (result.result === "succeeded") item.className = "succeeded";
      item.textContent = [result.kind, result.object].filter(Boolean).join(" ");
      more.textContent = ` ${[`${result.took_s} s`, result.attempt > 1 ? `attempt ${result.attempt}` : "", result.reason].filter(Boolean).join(" · ")}`;
      item.append(more);
      item.title = item.textContent;
      return item;
    }));
  },
  safety(content) {
    const name = content.state ?? "unknown";
    $("gate").dataset.state = name;
    text($("gate-state"), content.state ?? "–");
    $("gate").title = (content.faults ?? []).map((fault) => fault.sentence).join("; ");
  },
  stop(content) {
    $("stop").dataset.progress = content.progress;
    text($("stop-word"), { "not asked": "STOP", asked: "STOP …", stopping: "STOPPING", stopped: "STOPPED" }[content.progress] ?? "STOP");
    if (content.progress !== "not asked" && content.progress !== "asked") pressedAt = null;
  },
  arms(content) {
    $("arms").closest(".card").hidden = !content.length;
    document.body.classList.toggle("with-arms", content.length > 0);
    const busy = content.find((arm) => arm.goal.kind && !arm.goal.ended) ?? content.find((arm) => arm.sentence);
    if (busy && !state.words?.length) text($("sentence"), `${busy.name}: ${busy.sentence}`);
    $("arms").replaceChildren(...content.map((arm) => {
      const row = document.createElement("tr"), { kind, object, phase, state: reached, to } = arm.goal;
      const what = [kind, object].filter(Boolean).join(" "), progress = arm.goal.ended ? reached : phase || reached;
      cell(row, arm.name);
      const gate = cell(row, arm.gate.state, "state");
      gate.dataset.state = arm.gate.state;
      gate.title = arm.gate.faults.map((fault) => fault.sentence).join("; ");
      cell(row, [what, progress, to ? `→ ${cm(to)}` : ""].filter(Boolean).join(", ") || "nothing yet");
      cell(row, arm.sentence).title = arm.sentence;
      return row;
    }));
  },
  nodes(content) {
    $("nodes").closest(".card").hidden = !content.length;
    const body = $("nodes"), ok = content.filter((node) => node.state === "ready" && node.silent_s <= NO_STATUS_S).length;
    text($("nodes-note"), `${ok} of ${content.length} ready`);
    body.replaceChildren(...content.map((node) => {
      const row = document.createElement("tr"), silent = node.silent_s > NO_STATUS_S && node.state !== "stopped";
      cell(row, node.name).title = node.name;
      cell(row, silent ? `no status for ${node.silent_s} s` : node.state, "state").classList.add(silent ? "silent" : ["ready", "starting", "degraded", "failed", "stopped"].includes(node.state) ? node.state : "stopped");
      cell(row, node.ms === null ? "" : node.ms.toFixed(1), "num");
      cell(row, node.lost ? String(node.lost) : "", "num");
      cell(row, node.restarts ? String(node.restarts) : "", "num");
      cell(row, node.sentence).title = node.sentence;
      return row;
    }));
  },
};

function showRules(objects) {
  const names = Object.keys(objects);
  $("rules").closest(".card").hidden = !names.length && !state.page?.stages.length;
  $("rules").replaceChildren(...names.map((name) => {
    const row = document.createElement("tr"), object = objects[name], swatch = document.createElement("span"), first = row.insertCell();
    if (name === state.pointed) row.className = "pointed";
    swatch.className = "swatch";
    swatch.style.background = css(colourOf(name));
    first.append(swatch, name);
    cell(row, object.rule ? cm(object.rule.place) : "not learned yet", object.rule ? "" : "unknown");
    const stands = ["stands", "lies", "moves"].includes(object.state);
    cell(row, name === state.pointed ? "pointed at" : stands && object.place ? `${object.state} at ${cm(object.place)}` : object.state);
    return row;
  }));
  const learned = names.filter((name) => objects[name].rule).length;
  text($("rules-note"), names.length ? `${learned} of ${names.length} learned. Positions are x, y from ${state.page?.origin ?? "the base"}, as estimated by the robot.` : "No object detected yet.");
}

function draw() {
  const { tracked = {}, plane = {}, objects = {}, pointed = "", robot = {}, goal = {}, arm = {} } = state;
  camera.update({ tracked, plane, objects, pointed, arm });
  world.update({ world: state.world ?? null, robot, objects, goal, plane });
  world.draw();
  camera.draw();
}

// The server sends the next message once this one is drawn, so that a slow browser shows fewer states but no old ones.
async function take(data, from) {
  if (typeof data !== "string") { image = data; return; }
  handle(JSON.parse(data));
  if (!document.hidden) {
    if (image) {
      document.body.classList.add("with-picture");
      await camera.image(image);
    }
    image = null;
    await new Promise((done) => { requestAnimationFrame(done); setTimeout(done, 1000); });
    draw();
  }
  if (from.readyState === WebSocket.OPEN) from.send("next");
}

function handle(message) {
  const { beat, ended: farewell, ...sections } = message;
  if (beat) quietS = beat.quiet_s;
  if (farewell) { ended = farewell; $("gate").dataset.state = "ended"; text($("gate-state"), "ended"); }
  Object.assign(state, sections);
  for (const [name, content] of Object.entries(sections)) SHOW[name]?.(content);
  updateAlert();
}

function updateAlert() {
  const alert = $("alert"), stopped = (state.safety?.faults ?? []).map((fault) => fault.sentence).join("; ");
  const waited = pressedAt !== null && performance.now() - pressedAt > CONFIRM_MS;
  let warning = "", calm = false;
  if (waited || (pressedAt !== null && !connected)) warning = "The stop is NOT confirmed. Use the robot's power switch.";
  else if (ended) [warning, calm] = [`The run has ended${/^The run has ended/.test(ended) ? "" : `: ${ended}`}. The page shows its last state.`, true];
  else if (!connected && foreign) warning = "What answers here does not prove to be the page of this run: STOP does not reach the robot. Open the link that paramove launch --view printed last.";
  else if (!connected && everConnected && state.page?.robot === false) [warning, calm] = ["Waiting for the next step …", true];
  else if (!connected && everConnected) warning = "Connection lost: the page shows an old state, and STOP does not reach the robot. Trying again …";
  else if (!connected) warning = "Not connected. Open the link that paramove launch --view printed; it works once.";
  else if (stopped) warning = `The arm is stopped and holds its pose: ${stopped}.`;
  else if (quietS > QUIET_S) warning = `No news from the run for ${Math.round(quietS)} s.`;
  $("stop").disabled = Boolean(ended);
  text(alert, warning);
  alert.className = calm ? "calm" : "";
  alert.hidden = !warning;
  const age = performance.now() - camera.arrivedAt;
  text($("camera-note"), camera.arrived === 0 ? "no picture yet" : age > OLD_IMAGE_MS && !ended ? `picture is ${Math.round(age / 1000)} s old` : "");
}

function stop() {
  $("stop").dataset.progress = "asked";
  if (ended) return;
  pressedAt ??= performance.now();
  if (connected) socket.send("stop");
  updateAlert();
}

function connect() {
  const opened = new WebSocket(`ws://${location.host}/live`);
  socket = opened;
  opened.binaryType = "arraybuffer";
  opened.onopen = async () => {
    setTimeout(() => { if (opened === socket && !connected) opened.close(); }, PROOF_MS);
    foreign = !await proven(opened);
    if (foreign) { opened.close(); return; }
    opened.onmessage = ({ data }) => take(data, opened);
    connected = everConnected = true;
    ended = "";
    if (pressedAt !== null) opened.send("stop");
    updateAlert();
  };
  opened.onclose = ({ code }) => {
    if (code === 1001 && connected && !ended) ended = "The run has ended.";
    connected = false;
    updateAlert();
    if (!ended) setTimeout(connect, RETRY_MS);
  };
}

// Whether the other side proves to be the page; then this side proves itself, too. Nothing is shown or sent before.
async function proven(opened) {
  const message = () => new Promise((done) => { opened.onmessage = ({ data }) => done(data); });
  const mine = nonce();
  let answer = message();
  opened.send(mine);
  const [theirs, given] = String(await answer).split(" ");
  const keyOfPage = await keyFor(given, mine, theirs);
  if (!keyOfPage) return false;
  answer = message();
  opened.send(await proof(keyOfPage, "browser", location.host, mine, theirs));
  nextKey = JSON.parse(await answer).next_key;
  key = keyOfPage;
  localStorage.setItem("paramove-key", key);
  return true;
}

// The key with which a page has proved itself: that of the process that gave it, or of the one that follows.
async function keyFor(given, mine, theirs) {
  for (const candidate of [key, nextKey]) {
    if (candidate && given === await proof(candidate, "page", location.host, mine, theirs)) return candidate;
  }
  return "";
}

$("stop").addEventListener("click", stop);
addEventListener("keydown", (event) => {
  if (event.key !== " " && event.key !== "Escape") return;
  event.preventDefault();
  if (!event.repeat) stop();
});
new ResizeObserver(() => camera.draw()).observe($("camera"));
setInterval(updateAlert, 250);
connect();
