// Export and import.

import { make, part } from "../page";
import type { Session } from "../session";

const NAMES: Record<string, string> = {
  cells: "Class per cell",
  vertices: "Class per vertex",
  regions: "Regions",
  region_classes: "Class per region",
};

export class ExchangePanel {
  private readonly what = part<HTMLSelectElement>("export-what");
  private readonly format = part<HTMLSelectElement>("export-format");

  constructor(private readonly session: Session) {
    session.events.on("file", () => this.fillWhat());
    this.what.addEventListener("change", () => this.fillFormats());
    this.format.addEventListener("change", () => this.setDownload());
    part("export").addEventListener("click", () => void session.exportTo(this.format.value, this.what.value));
    const files = part<HTMLInputElement>("import");
    files.addEventListener("change", () => void this.read([...(files.files ?? [])]).then(() => (files.value = "")));
  }

  private get formats(): Record<string, string[]> {
    return this.session.state.exports ?? {};
  }

  private fillWhat(): void {
    const kinds = Object.keys(this.formats);
    this.what.replaceChildren(...kinds.map((kind) => make("option", { value: kind }, NAMES[kind] ?? kind)));
    this.fillFormats();
  }

  private fillFormats(): void {
    const formats = this.formats[this.what.value] ?? [];
    this.format.replaceChildren(...formats.map((format) => make("option", { value: format }, format)));
    this.setDownload();
  }

  private setDownload(): void {
    const link = part<HTMLAnchorElement>("download");
    link.href = this.session.downloadAddress(this.format.value, this.what.value);
  }

  /** One file as it is; of two, the one that groups the segments of the other. */
  private async read(files: File[]): Promise<void> {
    try {
      const contents = await Promise.all(files.map(async (file) => JSON.parse(await file.text()) as object));
      if (contents.length === 1) return await this.session.importFrom(contents[0]);
      const aggregation = contents.find((content) => "segGroups" in content);
      const segs = contents.find((content) => "segIndices" in content);
      if (contents.length !== 2 || !aggregation || !segs) {
        throw new Error("choose one file, or a .segs.json and its .aggregation.json");
      }
      await this.session.importFrom({ segs, aggregation });
    } catch (error) {
      this.session.report(error);
    }
  }
}
