// Entry point of the self-contained HTML page that superfacets.view writes.

import { decodeArrays, fromBase64 } from "../shared/arrays";
import { element } from "../shared/dom";
import type { Facts } from "./content";
import { Controls } from "./controls";
import { Panel } from "./panel";

declare global {
  interface Window {
    superfacets: Panel; // used by tests and benchmarks
  }
}

async function inflate(bytes: Uint8Array<ArrayBuffer>): Promise<ArrayBuffer> {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

async function open(): Promise<Panel> {
  const facts = JSON.parse(element("facts").textContent) as Facts;
  const payload = element("payload");
  const buffer = await inflate(fromBase64(payload.textContent.trim()));
  payload.remove(); // frees the memory of the base64 text
  const panel = new Panel(facts, decodeArrays(buffer, 0, facts.arrays));
  new Controls(panel);
  await panel.colored;
  return panel;
}

function fail(message: string): void {
  element("failure").textContent = `The mesh cannot be shown: ${message}.`;
  element("failure").hidden = false;
}

async function start(): Promise<void> {
  const { dataset } = document.documentElement;
  element("canvas").addEventListener("webglcontextlost", () => fail("the graphics card stopped responding; reload the page"));
  try {
    window.superfacets = await open();
    dataset.state = "ready";
  } catch (error) {
    fail((error as Error).message);
    dataset.state = "failed";
  }
}

window.addEventListener("load", () => void start());
