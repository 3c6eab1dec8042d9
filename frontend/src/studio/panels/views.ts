// Buttons and keys for standard views.

import { button, element, onClick } from "../../shared/dom";
import { NONE } from "../../shared/shape";
import type { Workbench } from "../workbench";
import { text } from "../text/index";

const words = text.views;
const MANY_BACKS = 0.2; // if a larger fraction of visible cells is seen from behind, walls probably hide the inside of a room

export class Views {
  private readonly usual: { name: string; key: string; what: string; run: () => void }[];

  constructor(private readonly workbench: Workbench) {
    const { camera } = workbench.drawing;
    const quarter = Math.PI / 2;
    const turn = (azimuth: number, elevation: number) => (): void => {
      if (!camera.isAt(azimuth, elevation)) camera.turnTo(azimuth, elevation);
      else camera.turnTo(azimuth + (elevation ? 0 : Math.PI), -elevation);
    };
    this.usual = [
      { name: words.front, key: "Alt+1", what: words.frontWhat, run: turn(0, 0) },
      { name: words.side, key: "Alt+2", what: words.sideWhat, run: turn(quarter, 0) },
      { name: words.top, key: "Alt+3", what: words.topWhat, run: turn(0, quarter) },
      { name: words.up, key: "Alt+4", what: words.upWhat, run: () => camera.turnUp() },
      { name: words.frame, key: "g", what: words.frameWhat, run: () => workbench.frameActive() },
      { name: words.reset, key: "Home", what: words.resetWhat, run: () => camera.home() },
      { name: words.back, key: "z", what: words.backWhat, run: () => workbench.goBack() },
    ];
    const buttons = this.usual.map(({ name, key, what, run }) => {
      return button(name, words.tip(what, key.length === 1 ? key.toUpperCase() : key), run);
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
    if (!session.mesh.hasNormals) return this.workbench.say(words.noNormals);
    this.hideBacks(!drawing.hidesBacks);
    this.workbench.say(drawing.hidesBacks ? words.backsHidden : words.backsShown);
  }

  /** Whether many visible cells are seen from behind, for example the walls of a room seen from outside. */
  get isSeenFromBehind(): boolean {
    const seen = [...new Set(this.workbench.drawing.cellsSeen().cells)].filter((cell) => cell !== NONE);
    return seen.filter((cell) => this.workbench.isBack(cell)).length > MANY_BACKS * seen.length;
  }

  keys(): { names: string[]; what: string; run: () => void }[] {
    return [
      ...this.usual.map(({ key, what, run }) => ({ names: [key], what, run })),
      { names: ["w"], what: words.insideWhat, run: () => this.toggleBacks() },
    ];
  }
}
