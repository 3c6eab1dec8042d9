// Walking: a wide view, in which the keys W, A, S and D move the eye while they are held.

import type { Workbench } from "../workbench";
import { element, onClick } from "../../shared/dom";
import { text } from "../text/index";

const WAYS: Record<string, [right: number, forward: number]> = { w: [0, 1], s: [0, -1], a: [-1, 0], d: [1, 0] };
const SPEED = 0.35; // distance per second, relative to the size of the mesh
const TAP_MS = 60; // smallest time for which a pressed key moves the eye, in milliseconds
const MAX_MS = 150; // longest time of one movement, so that a slow picture causes no jump

export class Walk {
  private readonly held = new Set<string>();
  private last = 0; // time of the last movement in milliseconds

  constructor(private readonly workbench: Workbench) {
    onClick("walk", () => this.toggle());
    window.addEventListener("keyup", ({ key }) => this.held.delete(key.toLowerCase()));
    window.addEventListener("blur", () => this.held.clear());
  }

  toggle(): void {
    const { camera } = this.workbench.drawing;
    camera.widen(!camera.isWide);
    element("walk").ariaPressed = String(camera.isWide);
    this.workbench.say(camera.isWide ? text.views.walking : text.views.walkEnded);
  }

  /** Begin to move if this is the press of a key that moves the eye; otherwise, return false. */
  press({ key, ctrlKey, altKey, metaKey, shiftKey, repeat }: KeyboardEvent): boolean {
    const isWay = key in WAYS && this.workbench.drawing.camera.isWide;
    if (!isWay || ctrlKey || altKey || metaKey || shiftKey) return false;
    if (repeat) return true;
    const isMoving = this.held.size > 0;
    this.held.add(key);
    if (!isMoving) {
      this.last = performance.now() - TAP_MS;
      this.move();
    }
    return true;
  }

  private move(): void {
    if (!this.held.size) return;
    const now = performance.now();
    const step = (SPEED * Math.min(MAX_MS, now - this.last)) / 1000;
    this.last = now;
    const [right, forward] = [...this.held].reduce(([x, z], key) => [x + WAYS[key][0], z + WAYS[key][1]], [0, 0]);
    this.workbench.drawing.camera.walk(step * right, 0, step * forward);
    requestAnimationFrame(() => this.move());
  }
}
