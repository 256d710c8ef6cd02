// A file that is saved from the page.
import { html } from "./words.js";

export const give = (name, content, type = "text/plain") => {
  const link = html("a"), address = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
};
