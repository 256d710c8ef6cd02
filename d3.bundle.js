// Writes reports/templates/page/d3.js, the parts of d3 that d3.d.ts names, from the versions in package-lock.json (make d3);
// with --check it says whether that file is what they give (make page).
import { build } from "esbuild";
import { readFileSync, writeFileSync } from "node:fs";

const PAGE = "reports/templates/page/d3";
// what d3-zoom and d3-scale name and a figure never asks for: views that move by themselves, places that are colours
const LEFT_OUT = {
  "d3-transition": 'import { selection } from "d3-selection"; export const interrupt = () => {}; selection.prototype.interrupt = function () { return this; };',
  "d3-color": "export class color {} export { color as rgb, color as hsl, color as lab, color as hcl, color as cubehelix };",
};
const lean = {
  name: "lean",
  setup(bundle) {
    bundle.onResolve({ filter: /^d3-(transition|color)$/ }, ({ path }) => ({ path, namespace: "lean" }));
    bundle.onLoad({ filter: /./, namespace: "lean" }, ({ path }) => ({ contents: LEFT_OUT[path], resolveDir: "." }));
  },
};
const { packages } = JSON.parse(readFileSync("package-lock.json", "utf8"));
const { metafile, outputFiles } = await build({ entryPoints: [`${PAGE}.d.ts`], outfile: "d3.js", bundle: true, minify: true, format: "esm", write: false, metafile: true, plugins: [lean] });
const taken = Object.entries(metafile.outputs["d3.js"].inputs).filter(([name, { bytesInOutput }]) => bytesInOutput && name.startsWith("node_modules"));
const parts = [...new Set(taken.map(([name]) => name.split("/", 2).join("/")))].sort();
const versions = parts.map((name) => `${name.split("/")[1]} ${packages[name].version}`).join(", ");
const licences = parts.map((name) => readFileSync(`${name}/LICENSE`, "utf8").trim().split("\n\n"));
if (new Set(licences.map(([, ...terms]) => terms.join())).size > 1) throw new Error("parts of d3 under other terms: say all of them");
const holders = [...new Set(licences.map(([holder]) => holder))].sort(), [[, ...terms]] = licences;
const text = `// @ts-nocheck\n/*! Parts of d3 (d3js.org): ${versions}\n\n${holders.join("\n")}\n\n${terms.join("\n\n")}\n*/\n${outputFiles[0].text}`;
if (!process.argv.includes("--check")) writeFileSync(`${PAGE}.js`, text);
else if (text !== readFileSync(`${PAGE}.js`, "utf8")) throw new Error(`${PAGE}.js is not what package-lock.json gives: make d3`);
