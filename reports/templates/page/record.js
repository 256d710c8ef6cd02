// A measured record dropped on the page, instead of the step.
import { recordOf } from "./columns.js";
import { desk, find } from "./desk.js";
import { start } from "./history.js";
import { compute } from "./module.js";
import { runStart } from "./trial.js";

export const take = async (file) => {
  try {
    desk.record = recordOf(file.name, await file.text());
    compute(start);
    runStart();
    desk.follow();
  } catch (error) {
    find(".record").textContent = `${file.name}: ${error.message}.`;
  }
};
