/** The page: messages go to scene and panel, commands go back. */

import { Actions } from "./actions.js";
import { Camera } from "./camera.js";
import { Connection } from "./connection.js";
import { Drop } from "./drop.js";
import { Gestures } from "./gestures.js";
import { listenToKeys } from "./keyboard.js";
import { Changes } from "./layers/changes.js";
import { boundsOf } from "./layers/map.js";
import { offerIncidents } from "./incidents.js";
import { Notices } from "./notices.js";
import { Panel } from "./panel.js";
import { Past } from "./past.js";
import { Scene } from "./scene.js";
import { Sheet } from "./sheet.js";
import { Renderer } from "./renderer.js";
import { Theme } from "./theme.js";
import { Timeline } from "./timeline.js";
import { Tour } from "./tour.js";
import { authorization, keepToken, takeTokenFromFragment, token } from "./token.js";
import { View } from "./view.js";
import { metres } from "./format.js";

const byId = (id) => document.getElementById(id);
const app = byId("app");
const redraw = () => renderer.invalidate();

takeTokenFromFragment();

const scene = new Scene();
const view = new View();
scene.changes = new Changes(() => redraw());
const notices = new Notices();
const timeline = new Timeline();
const theme = new Theme();
const camera = new Camera(view, scene, redraw);
const renderer = new Renderer(view, scene, theme.colours, beforeFrame);
const sheet = new Sheet(() => renderer.resize(sheet.covered()));
const connection = new Connection({
  onMessage: take,
  onFrame(frame) {
    scene.takeFrame(frame);
    past.attach(frame);
    if (scene.isLive) redraw();
  },
  onLost(waitMs) {
    app.dataset.connected = "false";
    notices.showLost(waitMs);
  },
  onTokenAsked: askForToken,
});
const actions = new Actions(connection, scene, view, notices, redraw, lookAtRobot);
const past = new Past({ onLook: lookBack, onLive: () => look(scene.live) });
const drop = new Drop({
  onLocated(frame) {
    sheet.close();
    look(frame);
  },
  onLeave: () => look(scene.live),
  onProblem: (text) => notices.showError(text),
});
const tour = new Tour((message) => actions.send(message));
const panel = new Panel({
  onPick: (id) => actions.pick(id),
  onHighlight: highlight,
  onNewState: (text) => notices.speak(text),
});

// ---- messages

function take(message) {
  if (message.type === "hello") greet(message);
  else if (message.type === "state") takeState(message);
  else if (message.type === "event") takeEvent(message);
  else if (message.type === "error") actions.refuse(message);
}

function takeEvent(event) {
  timeline.add(event);
  if (event.kind === "refused") actions.rejectPose(event.text);
}

function greet(hello) {
  app.dataset.connected = "true";
  notices.hideLost();
  lookAtRobot();
  scene.clearRobot();
  past.clear();
  timeline.replace(hello.events);
  actions.allow(hello);
  offerIncidents(hello, notices);
  tour.greet(hello);
  document.querySelector("[data-layer=truth]").hidden = hello.robot !== "sim";
  if (hello.map) showMap(hello.map);
}

function takeState(state) {
  scene.takeState(state);
  past.record(state, scene.live);
  actions.simulation.show(state);
  tour.show(state);
  if (scene.isLive) showState(state);
}

function lookBack(frame) {
  drop.leave();
  look(frame);
}

/** A command is for the robot as it is now. */
function lookAtRobot() {
  drop.leave();
  past.goLive();
}

/** Look at a frame: the robot as it is, or as it was. */
function look(frame) {
  const before = scene.map;
  scene.frame = frame;
  app.dataset.time = scene.isLive ? "live" : drop.isOpen ? "file" : "past";
  panel.isLive = scene.isLive;
  if (scene.map !== before) showOtherMap();
  if (frame.state) showState(frame.state);
  redraw();
}

function showState(state) {
  panel.show(state);
  byId("decide").hidden = !state.motion || !actions.canDecide;
  app.dataset.pose = numbers(state.pose);
  app.dataset.truth = numbers(state.truth);
  app.dataset.amcl = numbers(state.amcl?.pose);
  redraw();
}

/** Fetch what has changed in the map while a person wants to see it. */
function showChanges() {
  const { map } = scene.live;
  scene.changes.show(scene.shown.changes && map?.changes ? map : null);
}

async function showMap(map) {
  panel.showMap(map);
  document.querySelector("[data-layer=changes]").hidden = !map.changes;
  const { live } = scene;
  if (live.image && JSON.stringify(map) === JSON.stringify(live.map)) return;
  Object.assign(live, { map, image: null });
  showChanges();
  view.bounds = boundsOf(map);
  renderer.resize(sheet.covered());
  camera.fit();
  const image = await imageOf(map).catch((problem) => {
    notices.showError(`The image of the map could not be loaded: ${problem.message}.`);
    return null;
  });
  if (live.map !== map || !image) return; // another map was received meanwhile
  live.image = image;
  renderer.recolour();
  app.dataset.map = map.name;
  performance.mark("map-shown");
}

/** A map of a file, or the robot's again. */
function showOtherMap() {
  panel.showMap(scene.map);
  view.bounds = boundsOf(scene.map);
  renderer.recolour();
  camera.fit();
}

async function imageOf(map) {
  const answer = await fetch(map.image.url, { headers: authorization() });
  if (!answer.ok) throw new Error(`status ${answer.status}`);
  return createImageBitmap(await answer.blob());
}

function askForToken() {
  app.dataset.connected = "false";
  byId("token-text").textContent =
    token() ? "This token is wrong." : "The person who started firstfix has it. It is kept until this tab is closed.";
  keepToken(null);
  const dialog = byId("token-dialog");
  if (!dialog.open) dialog.showModal();
}

// ---- drawing

function beforeFrame(now) {
  camera.frame(now);
  notices.placeAnswer(view);
  app.dataset.view = numbers([view.scale, view.x, view.y, ...view.middle]);
}

function highlight(id) {
  if (scene.highlighted === id) return;
  scene.highlighted = id;
  redraw();
}

function hover(place, hypothesis = null) {
  byId("cursor-text").textContent = place ? `${metres(place[0])}, ${metres(place[1])}` : "";
  highlight(hypothesis);
  app.dataset.over = hypothesis !== null && actions.maySteer ? "hypothesis" : "";
}

/** What is shown, readable from outside: for tests. */
function numbers(values) {
  return values ? values.map((value) => value.toFixed(4)).join(" ") : "";
}

// ---- input

/** Leave one thing: a mode, the past, or the tour. */
function leave() {
  if (scene.mode !== "look") actions.leaveMode();
  else if (drop.isOpen) drop.leave();
  else if (past.isLive) tour.leave();
  else past.goLive();
}

new Gestures(byId("overlay"), view, scene, {
  onViewed: () => camera.movedByHand(),
  onHover: hover,
  onDraft: redraw,
  onSet: () => actions.set(),
  onPick: (id) => actions.pick(id),
  onGroup: (places) => {
    if (!camera.separate(places)) panel.focusPlace(places[0].id);
  },
  onNoDrag: () => actions.needsDrag(),
  onLongPress: () => actions.enterPoseMode(),
});

listenToKeys({
  view,
  scene,
  actions,
  onViewed: () => camera.movedByHand(),
  onDraft: redraw,
  commands: {
    f: () => camera.fit(),
    l: () => camera.toggleFollow(),
    d: () => theme.toggle(),
    p: () => actions.toggleModeByKey("pose"),
    g: () => actions.toggleModeByKey("goal"),
    c: () => actions.toggleModeByKey("carry"),
    k: () => actions.kidnap(),
    r: () => actions.relocalize(),
    Space: () => actions.togglePause(),
    t: () => tour.toggle(),
    ",": () => past.step(-1),
    ".": () => past.step(1),
    escape: leave,
    "?": () => byId("help-dialog").showModal(),
  },
});

theme.onChange = () => renderer.recolour();
byId("theme").addEventListener("click", () => theme.toggle());
byId("help").addEventListener("click", () => byId("help-dialog").showModal());
byId("retry").addEventListener("click", () => connection.open());
byId("token-form").addEventListener("submit", () => {
  keepToken(byId("token").value);
  byId("token").value = "";
  connection.open();
});
byId("token-dialog").addEventListener("cancel", (event) => event.preventDefault());
for (const chip of document.querySelectorAll("#show .chip")) {
  chip.addEventListener("click", () => {
    const { layer } = chip.dataset;
    scene.shown[layer] = !scene.shown[layer];
    chip.setAttribute("aria-pressed", String(scene.shown[layer]));
    if (layer === "changes") showChanges();
    redraw();
  });
}

addEventListener("resize", () => renderer.resize(sheet.covered()));
renderer.resize(sheet.covered());
connection.open();
