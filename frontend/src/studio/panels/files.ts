// Panel with the files of a folder: thumbnails, progress, and buttons for the next and the previous file.

import { ServerError } from "../session/api";
import type { FileEntry, Statistics } from "../data/contract";
import { element, make, onClick } from "../../shared/dom";
import type { Session } from "../session/session";
import { text } from "../text/index";

export class FilesPanel {
  private asked = -1; // id of the file requested last, which may have failed to open; -1 if there is none
  private readonly rows = new Map<number, { button: HTMLButtonElement; bar: HTMLProgressElement }>();

  constructor(private readonly session: Session) {
    session.events.on("files", (files) => this.fill(files));
    session.events.on("file", () => this.showCurrent());
    session.events.on("state", () => this.showProgress());
    session.events.on("painted", () => this.showProgress());
    onClick("previous-file", () => this.go(-1));
    onClick("next-file", () => this.go(1));
  }

  private fill(files: FileEntry[]): void {
    element("files-section").hidden = files.length < 2;
    this.rows.clear();
    element("files").replaceChildren(...files.map((file) => make("li", {}, this.row(file))));
  }

  private row({ id, name, done, error, reviewed, changed_since_review: isChanged, statistics }: FileEntry): HTMLButtonElement {
    const source = this.session.thumbnailAddress(id);
    const picture = make("img", { src: source, alt: "", loading: "lazy" });
    picture.addEventListener("error", () => picture.replaceWith(make("span", { class: "blank" })));
    const title = this.told(done, statistics);
    const bar = make("progress", { max: "1", value: String(done), "aria-label": text.files.labeled(name), title });
    const button = make("button", { type: "button" }, picture, make("span", { class: "name" }, `${isChanged ? "✓? " : reviewed ? "✓ " : ""}${name}`), bar);
    if (reviewed) button.title = isChanged ? text.files.changed : text.files.reviewed;
    if (error) {
      button.title = error; // the work file of this mesh is damaged
      button.classList.add("damaged");
    }
    button.addEventListener("click", () => this.open(id));
    this.rows.set(id, { button, bar });
    return button;
  }

  private showCurrent(): void {
    for (const [id, { button }] of this.rows) button.ariaCurrent = String(id === this.session.fileId);
    this.rows.get(this.session.fileId)?.button.scrollIntoView({ block: "nearest" });
  }

  private showProgress(): void {
    const row = this.rows.get(this.session.fileId);
    if (!row || !this.session.paints) return;
    row.bar.value = this.session.paints.progress;
    row.bar.title = this.told(this.session.paints.progress, this.session.state.statistics);
  }

  /** The labeled fraction, and the time and strokes of the work if they are known. */
  private told(done: number, took?: Statistics): string {
    return text.list([text.percent(done), ...(took ? [text.files.effort(took.seconds, took.strokes)] : [])]);
  }

  /** Open the file that is `steps` entries below the last requested file in the list. */
  go(steps: number): void {
    const { files } = this.session;
    const at = files.findIndex(({ id }) => id === this.asked) + steps;
    if (at < 0 || at >= files.length) {
      this.session.events.emit("message", steps > 0 ? text.files.isLast : text.files.isFirst);
      return;
    }
    this.open(files[at].id);
  }

  /** Open the file of the last step or, if it cannot be read, the one before. Throws an error if no file can be read. */
  async openFirst(): Promise<void> {
    const damaged: string[] = [];
    for (const { id } of [...this.session.files].sort((a, b) => (b.time ?? 0) - (a.time ?? 0))) {
      this.asked = id;
      try {
        await this.session.open(id);
        if (damaged.length) this.session.report(new Error(damaged.join(" ")));
        return;
      } catch (error) {
        if (!(error instanceof ServerError)) throw error;
        damaged.push(error.message);
      }
    }
    throw new Error(damaged.join(" "));
  }

  private open(id: number): void {
    this.asked = id;
    element("loading").hidden = false;
    this.session.open(id).catch((error: unknown) => this.session.report(error, id))
      .finally(() => (element("loading").hidden = true));
  }
}
