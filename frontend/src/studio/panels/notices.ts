// Messages, errors, and a banner that is shown while the server does not respond.

import { element } from "../../shared/dom";
import { ServerError } from "../session/api";
import type { Session } from "../session/session";
import { text } from "../text/index";

const words = text.session;

export function showNotices(session: Session): void {
  const { events } = session;
  const error = element("error");
  const [line, close] = error.children as unknown as HTMLElement[];
  close.addEventListener("click", () => {
    error.hidden = true;
    element("canvas").focus();
  });
  events.on("error", (told) => {
    line.textContent = told;
    error.hidden = false;
  });
  events.on("message", (told) => {
    element("status").textContent = told;
    error.hidden = true;
  });
  events.on("online", (isOnline) => {
    element("banner").hidden = isOnline;
    showWaiting(session);
    if (isOnline) events.emit("message", words.back);
  });
  events.on("state", () => {
    showWaiting(session);
    element("saved").textContent = savedText(session);
  });
  events.on("file", (mesh) => {
    element("file-name").textContent = session.state.input.name;
    document.title = text.files.title(session.state.input.name);
    element("file-facts").textContent = mesh.counted(mesh.nCells);
    events.emit("message", session.state.notes.join(" ")); // replaces messages about the file that was open before
  });
  window.addEventListener("beforeunload", (event) => {
    if (session.nWaiting) event.preventDefault();
  });
}

/** Text that says whether all labels are saved, and when they were last saved. */
export function savedText({ nWaiting, savedAt }: Session): string {
  if (nWaiting) return words.saving;
  return savedAt ? words.savedAt(savedAt) : words.allSaved;
}

function showWaiting({ online, outage, nWaiting, isKept }: Session): void {
  if (online) return;
  const why = outage instanceof ServerError ? words.cannotSave(outage.message) : words.silent;
  const kept = nWaiting ? [words.unsaved(nWaiting), ...(isKept ? [] : [words.keepOpen])] : [words.nothingUnsaved];
  element("banner").textContent = [why, ...kept, words.paintOn].join(" ");
}
