// Buttons and keys for usual views.

import type { Desk } from "./desk";
import { make, part } from "../shared/dom";

interface Usual {
  name: string;
  key: string;
  what: string;
  run: () => void;
}

export class Views {
  private readonly usual: Usual[];

  constructor(desk: Desk) {
    const { camera } = desk.drawing;
    const quarter = Math.PI / 2;
    this.usual = [
      { name: "Front", key: "Alt+1", what: "from the front", run: () => camera.turnTo(0, 0) },
      { name: "Side", key: "Alt+2", what: "from the right side", run: () => camera.turnTo(quarter, 0) },
      { name: "Top", key: "Alt+3", what: "from the top", run: () => camera.turnTo(0, quarter) },
      { name: "Frame", key: "g", what: "go to the region under the pointer, or the chosen object", run: () => desk.frameActive() },
      { name: "Reset", key: "Home", what: "the view of the beginning", run: () => camera.home() },
    ];
    const buttons = this.usual.map(({ name, key, what, run }) => {
      const title = `${what[0].toUpperCase()}${what.slice(1)} (${key.length === 1 ? key.toUpperCase() : key})`;
      const button = make("button", { type: "button", title }, name);
      button.addEventListener("click", run);
      return button;
    });
    part("views").prepend(...buttons);
  }

  keys(): { names: string[]; what: string; onCanvas: boolean; run: () => void }[] {
    return this.usual.map(({ key, what, run }) => ({ names: [key], what, onCanvas: key === "Home", run }));
  }
}
