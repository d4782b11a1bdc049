// Script of a page without geometry: sortable tables and copy buttons.
import { filters } from "./filters.js";
import { copyButtons, sortableTables } from "./tables.js";

document.documentElement.classList.add("js");
sortableTables();
copyButtons();
filters();
