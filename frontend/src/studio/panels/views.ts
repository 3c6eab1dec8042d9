// Buttons and keys for standard views.

import { button, element, onClick } from "../../shared/dom";
import { NONE } from "../../shared/shape";
import { dot, minus, plus } from "../../shared/vectors";
import type { Workbench } from "../workbench";

const MANY_BACKS = 0.2; // if a larger fraction of visible cells is seen from behind, walls probably hide the inside of a room

interface Usual {
  name: string;
  key: string;
  what: string;
  run: () => void;
}

export class Views {
  private readonly usual: Usual[];

  constructor(private readonly workbench: Workbench) {
    const { camera } = workbench.drawing;
    const quarter = Math.PI / 2;
    const turn = (azimuth: number, elevation: number) => (): void => {
      if (!camera.isAt(azimuth, elevation)) camera.turnTo(azimuth, elevation);
      else camera.turnTo(azimuth + (elevation ? 0 : Math.PI), -elevation);
    };
    this.usual = [
      { name: "Front", key: "Alt+1", what: "from the front; again: from the back", run: turn(0, 0) },
      { name: "Side", key: "Alt+2", what: "from the right side; again: from the left side", run: turn(quarter, 0) },
      { name: "Top", key: "Alt+3", what: "from the top; again: from below", run: turn(0, quarter) },
      { name: "Frame", key: "g", what: "go to the region under the pointer or to the chosen object, and turn the view around it", run: () => workbench.frameActive() },
      { name: "Reset", key: "Home", what: "the initial view", run: () => camera.home() },
    ];
    const buttons = this.usual.map(({ name, key, what, run }) => {
      const title = `${what[0].toUpperCase()}${what.slice(1)} (${key.length === 1 ? key.toUpperCase() : key})`;
      return button(name, title, run);
    });
    element("views").prepend(...buttons);
    onClick("inside", () => this.toggleBacks());
    workbench.session.events.on("file", (mesh) => this.hideBacks(workbench.drawing.hidesBacks && mesh.hasNormals));
  }

  /** Hide or show triangles and points that are seen from behind. */
  hideBacks(on: boolean): void {
    this.workbench.drawing.hidesBacks = on;
    element("inside").ariaPressed = String(on);
    this.workbench.drawing.changeView();
  }

  private toggleBacks(): void {
    const { drawing, session } = this.workbench;
    if (!session.mesh.hasNormals) {
      return this.workbench.say("The point cloud has no normals, so it is unknown which points are seen from behind. Hide points with H or the clip box (C).");
    }
    this.hideBacks(!drawing.hidesBacks);
    this.workbench.say(drawing.hidesBacks ? "Surfaces seen from behind are hidden; W shows them." : "Surfaces are shown from both sides.");
  }

  /** Whether many visible cells are seen from behind, for example the walls of a room seen from outside. */
  get isSeenFromBehind(): boolean {
    const { drawing, session: { mesh } } = this.workbench;
    const eye = plus(drawing.camera.target, drawing.camera.directions()[2], drawing.camera.distance);
    const seen = [...new Set(drawing.cellsSeen().cells)].filter((cell) => cell !== NONE);
    const isBack = (cell: number): boolean => dot(mesh.normalOf(cell), minus(eye, mesh.middleOf(cell)!)) < 0;
    return seen.filter(isBack).length > MANY_BACKS * seen.length;
  }

  keys(): { names: string[]; what: string; run: () => void }[] {
    return [
      ...this.usual.map(({ key, what, run }) => ({ names: [key], what, run })),
      { names: ["w"], what: "see inside: hide surfaces seen from behind, such as walls", run: () => this.toggleBacks() },
    ];
  }
}
