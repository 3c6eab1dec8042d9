// The place where the user works in each file: view, tool, class and object. It survives a reload of the page.

import { remember, rememberedValue } from "../session/remembered";
import { classOf, objectOf } from "../data/labeling";
import type { ModeName, Modes } from "./modes";
import type { Views } from "../panels/views";
import type { Workbench } from "../workbench";

interface Place {
  camera: number[]; // see `Camera.place`
  hidesBacks: boolean; // whether surfaces seen from behind are hidden
  mode: ModeName;
  paint: number; // class and object as one number
}

export class PlaceKeeper {
  private kept = ""; // name of the stored place of the open file; empty until that place is shown again
  private wanted: Place | null = null; // the stored place of the file that is being opened

  constructor(private readonly workbench: Workbench, private readonly modes: Modes, private readonly views: Views) {
    const { session, drawing } = workbench;
    session.events.on("file", () => this.comeBack());
    session.events.on("classes", () => this.choosePaint());
    workbench.events.on("current-paint", () => this.keep());
    drawing.onView.push(() => this.keep());
    modes.onChoose.push(() => this.keep());
  }

  private get name(): string {
    const { work, input } = this.workbench.session.state;
    return `superfacets place ${work} ${input.sha256 ?? ""}`;
  }

  private comeBack(): void {
    this.kept = "";
    this.wanted = rememberedValue<Place>(this.name);
    if (!this.wanted) return;
    this.workbench.drawing.camera.place = this.wanted.camera;
    this.views.hideBacks(this.wanted.hidesBacks);
    this.modes.choose(this.wanted.mode);
  }

  /** Choose the stored class and object when the classes of the file are known; a deleted class is not chosen. */
  private choosePaint(): void {
    if (this.kept) return;
    const paint = this.wanted?.paint;
    const { classes } = this.workbench.session.state;
    if (paint !== undefined && (!paint || classes.some(({ id }) => id === classOf(paint)))) this.workbench.choose(classOf(paint), objectOf(paint));
    this.kept = this.name;
    this.keep();
  }

  private keep(): void {
    const { session, drawing, currentPaint } = this.workbench;
    if (!session.state || this.kept !== this.name) return; // another file is being opened
    const place: Place = { camera: drawing.camera.place, hidesBacks: drawing.hidesBacks, mode: this.modes.current, paint: currentPaint };
    remember(this.kept, JSON.stringify(place));
  }
}
