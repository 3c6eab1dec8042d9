// Messages, errors, and a banner that is shown while the server does not respond.

import { counted, element } from "../../shared/dom";
import { ServerError } from "../session/api";
import type { Session } from "../session/session";

export function showNotices(session: Session): void {
  const { events } = session;
  const error = element("error");
  const [line, close] = error.children as unknown as HTMLElement[];
  close.addEventListener("click", () => {
    error.hidden = true;
    element("canvas").focus();
  });
  events.on("error", (text) => {
    line.textContent = text;
    error.hidden = false;
  });
  events.on("message", (text) => {
    element("status").textContent = text;
    error.hidden = true;
  });
  events.on("online", (isOnline) => {
    element("banner").hidden = isOnline;
    showWaiting(session);
    if (isOnline) events.emit("message", "The server is back; everything is saved.");
  });
  events.on("state", () => {
    showWaiting(session);
    element("saved").textContent = savedText(session);
  });
  events.on("file", (mesh) => {
    element("file-name").textContent = session.state.input.name;
    document.title = `${session.state.input.name} – Superfacets studio`;
    element("file-facts").textContent = counted(mesh.nCells, mesh.oneCell, mesh.cellName);
    events.emit("message", session.state.notes.join(" ")); // replaces messages about the file that was open before
  });
  window.addEventListener("beforeunload", (event) => {
    if (session.nWaiting) event.preventDefault();
  });
}

/** Text that says whether all labels are saved, and when they were last saved. */
export function savedText({ nWaiting, savedAt }: Session): string {
  if (nWaiting) return "Saving …";
  return savedAt ? `Saved ${savedAt.toLocaleTimeString("en-GB")}` : "All saved";
}

function showWaiting({ online, outage, nWaiting, isKept }: Session): void {
  if (online) return;
  const why = outage instanceof ServerError ? `The server cannot save strokes: ${outage.message}.` : "The server does not answer.";
  const where = isKept ? "" : " Do not close this page: the storage of the browser is full or disabled.";
  const kept = nWaiting ? `${counted(nWaiting, "unsaved stroke")} will be saved as soon as possible.${where}` : "Everything is saved.";
  element("banner").textContent = `${why} ${kept} You can continue to paint; undo and other changes have to wait.`;
}
