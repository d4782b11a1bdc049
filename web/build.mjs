// Bundles the scripts of report pages into borecheck/report/assets, with the licence of
// what they contain. `node build.mjs FOLDER` writes elsewhere.
import { build } from "esbuild";
import { copyFileSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";

const out = process.argv[2] ?? "../borecheck/report/assets";
const { version } = JSON.parse(readFileSync("node_modules/three/package.json", "utf8"));

async function bundled(entry) {
  const { outputFiles } = await build({
    entryPoints: [entry],
    bundle: true,
    minify: true,
    write: false,
    format: "iife",
    target: "es2022",
    charset: "ascii",
    legalComments: "none",
  });
  // It stands inside a script element: nothing in it may end or open one.
  const text = outputFiles[0].text.replaceAll("</", "<\\/").replaceAll("<!--", "<\\!--");
  return `${text.trim()}\n`;
}

const notice = `/* contains three.js ${version}, MIT licence, Copyright 2010-2026 three.js authors */\n`;
writeFileSync(join(out, "page.js"), await bundled("src/page.js"));
writeFileSync(join(out, "page_view.js"), notice + (await bundled("src/page_view.js")));
copyFileSync("node_modules/three/LICENSE", join(out, "three.LICENSE"));
