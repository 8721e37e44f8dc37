"use strict";
// Comfort alone: every page works without. It tells when a page is out of date, and shows a motion while it lasts.
const stop = document.getElementById("stop");
document.addEventListener("keydown", event => { if (event.key === "Escape" && stop) stop.requestSubmit(); });

for (const form of document.querySelectorAll("form[data-pause]")) {
  const button = form.querySelector("button");
  button.disabled = true;  // nobody approves by a click that was meant for the page before
  setTimeout(() => { button.disabled = false; }, 2000);
}
let isEdited = false, isLeaving = false;
for (const form of document.forms) form.addEventListener("submit", () => { isLeaving = true; });  // its answer is the next page
for (const form of document.querySelectorAll("main form")) {
  form.addEventListener("input", () => { isEdited = true; });
  form.addEventListener("submit", () => { setTimeout(() => { for (const button of form.querySelectorAll("button")) button.disabled = true; }); });
}

const mark = document.body.dataset.mark;
if (mark !== undefined) listen();

function listen() {
  const outdated = document.getElementById("outdated"), silent = document.getElementById("silent");
  let heard = Date.now();
  const source = new EventSource("/live");
  source.onmessage = event => {
    heard = Date.now();
    silent.hidden = true;
    if (isLeaving) return;
    const told = JSON.parse(event.data);
    if (told.mark === mark) show(told.live);
    else if (isEdited || location.pathname !== "/") outdated.hidden = false;
    else location.reload();
  };
  setInterval(() => { silent.hidden = Date.now() - heard < 5000; }, 1000);
}

const past = [];
function show(live) {
  if (!live.command) return;
  const bar = document.getElementById("progress");
  if (!bar) return;
  const rows = document.querySelectorAll("tr[data-channel]");
  if (rows.length !== live.command.length) { location.reload(); return; }
  bar.max = live.steps; bar.value = live.sent;
  document.getElementById("steps").textContent = `${live.sent} of ${live.steps} commands, ${live.seconds.toFixed(1)} s` + (live.late ? `, ${live.late} late` : "");
  past.push(live.command);
  if (past.length > 80) past.shift();
  rows.forEach((row, index) => {
    row.querySelector("output").textContent = live.command[index].toFixed(3);
    const values = past.map(each => each[index]), low = Math.min(...values), range = Math.max(...values) - low || 1;
    row.querySelector("polyline").setAttribute("points", values.map((value, at) => `${2 * at},${22 - 20 * (value - low) / range}`).join(" "));
  });
}
