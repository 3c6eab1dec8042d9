// Panels for import and export.

import { toBase64 } from "../../shared/arrays";
import { element, make, onClick } from "../../shared/dom";
import type { Session } from "../session/session";
import { text } from "../text/index";

const words = text.exchange;

export class ExchangePanel {
  private readonly what = element<HTMLSelectElement>("export-what");
  private readonly format = element<HTMLSelectElement>("export-format");

  constructor(private readonly session: Session) {
    session.events.on("file", () => this.fillWhat());
    this.what.addEventListener("change", () => this.fillFormats());
    this.format.addEventListener("change", () => this.setDownload());
    session.events.on("state", () => (element("export-old").hidden = !session.isExportOld));
    onClick("download", () => {
      session.noteExport();
      session.events.emit("message", words.downloaded(this.downloadName));
    });
    onClick("export", () => void session.exportTo(this.format.value, this.what.value));
    const files = element<HTMLInputElement>("import");
    files.addEventListener("change", () => void this.read([...(files.files ?? [])]).then(() => (files.value = "")));
  }

  private get formats(): Record<string, Record<string, string>> {
    return this.session.state.exports ?? {};
  }

  /** Name of the file that the server writes. */
  private get name(): string {
    return this.formats[this.what.value]?.[this.format.value] ?? "";
  }

  /** Name of the downloaded file. The two files of the ScanNet format are downloaded as a zip archive. */
  private get downloadName(): string {
    return this.name.replace(/aggregation\.json$/, "scannet.zip");
  }

  private fillWhat(): void {
    const kinds = Object.keys(this.formats);
    this.what.replaceChildren(...kinds.map((kind) => make("option", { value: kind }, words.data[kind] ?? kind)));
    this.fillFormats();
  }

  private fillFormats(): void {
    const isObjects = this.what.value === "objects";
    const formats = Object.keys(this.formats[this.what.value] ?? {});
    const listed = formats.filter((format) => !isObjects || format !== "segs.json"); // segs.json is written together with aggregation.json
    this.format.replaceChildren(...listed.map((format) => this.option(format)));
    this.setDownload();
  }

  private option(format: string): HTMLOptionElement {
    const name = this.what.value === "objects" ? words.objectFormats[format] : undefined;
    return make("option", { value: format }, name ?? format);
  }

  private setDownload(): void {
    element("export-name").textContent = this.name;
    const link = element<HTMLAnchorElement>("download");
    link.href = this.session.downloadAddress(this.format.value, this.what.value);
  }

  private async read(files: File[]): Promise<void> {
    const asSuggestions = element<HTMLInputElement>("as-suggestions").checked;
    try {
      const contents = files.map(async (file) => ({
        name: file.name,
        data: toBase64(new Uint8Array(await file.arrayBuffer())),
      }));
      if (files.length) await this.session.importFrom(await this.session.whileOpen(Promise.all(contents)), asSuggestions);
    } catch (error) {
      this.session.report(error);
    }
  }
}
