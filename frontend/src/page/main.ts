// Viewer of a page that superfacets.view has written: one file that works offline.

import { decodeArrays, fromBase64 } from "../shared/arrays";
import { part } from "../shared/dom";
import type { Facts } from "./content";
import { Controls } from "./controls";
import { Panel } from "./panel";

declare global {
  interface Window {
    superfacets: Panel; // for tests and measurements
  }
}

async function inflate(bytes: Uint8Array<ArrayBuffer>): Promise<ArrayBuffer> {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

async function open(): Promise<Panel> {
  const facts = JSON.parse(part("facts").textContent) as Facts;
  const element = part("payload");
  const buffer = await inflate(fromBase64(element.textContent.trim()));
  element.remove(); // frees the text of the element, which is as large as the mesh
  const panel = new Panel(facts, decodeArrays(buffer, 0, facts.arrays));
  new Controls(panel);
  await panel.textured;
  return panel;
}

function fail(message: string): void {
  part("failure").textContent = `The mesh cannot be shown: ${message}.`;
  part("failure").hidden = false;
}

window.addEventListener("load", async () => {
  const { dataset } = document.documentElement;
  part("canvas").addEventListener("webglcontextlost", () => fail("the graphics card does not answer; reload the page"));
  try {
    window.superfacets = await open();
    dataset.state = "ready";
  } catch (error) {
    fail((error as Error).message);
    dataset.state = "failed";
  }
});
