// Script of a page with geometry: what every page has, and the 3-D view.
import "./page.js";
import { startView } from "./view.js";

const result = JSON.parse(document.getElementById("borecheck-result").textContent);
startView(result).catch((error) => {
  document.documentElement.classList.add("no-gl");
  const note = document.getElementById("view-note");
  note.hidden = false;
  note.textContent = `No 3-D view here (${error.message}): see the pictures below.`;
});
