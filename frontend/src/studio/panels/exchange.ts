// Panels for import and export.

import { toBase64 } from "../../shared/arrays";
import { element, make, onClick } from "../../shared/dom";
import type { Session } from "../session/session";
import { text } from "../text/index";

const words = text.exchange;
const REST_MS = 500; // time without changes after which exports are compared with the labels

export class ExchangePanel {
  private readonly what = element<HTMLSelectElement>("export-what");
  private readonly format = element<HTMLSelectElement>("export-format");
  private readonly link = element<HTMLAnchorElement>("download");
  private resting = 0; // timer that ends when the labels have not changed for a while

  constructor(private readonly session: Session) {
    session.events.on("file", () => {
      this.fillWhat();
      element("export-old").hidden = true;
    });
    this.what.addEventListener("change", () => this.fillFormats());
    this.format.addEventListener("change", () => this.setDownload());
    session.events.on("state", () => this.markOldSoon());
    this.link.addEventListener("click", (event) => void this.download(event));
    onClick("export", () => void session.exportTo(this.format.value, this.what.value));
    const files = element<HTMLInputElement>("import");
    files.addEventListener("change", () => void this.read([...(files.files ?? [])]).then(() => (files.value = "")));
  }

  /** Tell whether exports are out of date, but not while the user paints. */
  private markOldSoon(): void {
    clearTimeout(this.resting);
    this.resting = window.setTimeout(() => (element("export-old").hidden = !this.session.isExportOld), REST_MS);
  }

  private async download(event: Event): Promise<void> {
    event.preventDefault();
    const { session, downloadName, link: { href } } = this;
    const { fileId } = session;
    const isStarted = await session.download(() => make("a", { href, download: "" }).click());
    if (isStarted) session.tell(words.downloaded(downloadName), fileId);
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
    this.format.replaceChildren(...listed.map((format) => {
      return make("option", { value: format }, (isObjects ? words.objectFormats[format] : undefined) ?? format);
    }));
    this.setDownload();
  }

  private setDownload(): void {
    element("export-name").textContent = this.name;
    this.link.href = this.session.downloadAddress(this.format.value, this.what.value);
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
