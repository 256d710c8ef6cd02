"use strict";
(() => {
  const folds = () => document.querySelectorAll("details");
  const open = (target) => {
    for (let node = target; node; node = node.parentElement) if (node.tagName === "DETAILS") node.open = true;
  };
  const follow = () => {
    if (location.hash.length > 1) open(document.getElementById(decodeURIComponent(location.hash.slice(1))));
  };
  addEventListener("hashchange", follow);
  follow();
  if (matchMedia("(max-width: 68rem)").matches) document.querySelectorAll(".toc details").forEach((d) => (d.open = false));
  let closed = [];
  addEventListener("beforeprint", () => {
    const shut = [...folds()].filter((d) => !d.open);
    shut.forEach((d) => (d.open = true));
    closed = closed.concat(shut);
  });
  addEventListener("afterprint", () => {
    closed.forEach((d) => (d.open = false));
    closed = [];
  });
})();
