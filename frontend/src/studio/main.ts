// Puts the studio together.

import "./studio.css";
import { Api } from "./api";
import { Desk } from "./desk";
import { Drawing } from "./drawing";
import { type Hook, makeHook } from "./hook";
import { Keys } from "./keys";
import { Modes } from "./modes";
import { showNotices } from "./notices";
import { part } from "../shared/dom";
import { ClassesPanel } from "./panels/classes";
import { ExchangePanel } from "./panels/exchange";
import { FilesPanel } from "./panels/files";
import { ParametersPanel } from "./panels/parameters";
import { Pointer } from "./pointer";
import { Session } from "./session";

declare global {
  interface Window {
    studio: Hook;
  }
}

async function start(): Promise<void> {
  const token = new URLSearchParams(location.search).get("token") ?? "";
  const session = new Session(new Api(token));
  showNotices(session);
  try {
    const drawing = new Drawing(part<HTMLCanvasElement>("canvas"), (line) => session.events.emit("error", line));
    const desk = new Desk(session, drawing);
    const modes = new Modes(desk);
    const files = new FilesPanel(session);
    new Pointer(desk, modes);
    new Keys(desk, modes, (steps) => files.go(steps));
    new ClassesPanel(desk);
    new ParametersPanel(session);
    new ExchangePanel(session);
    watchTools(desk);
    window.studio = makeHook(desk, modes, () => part("loading").hidden === true);
    await session.loadFiles();
    await files.openFirst();
  } catch (error) {
    session.report(error);
  }
  part("loading").hidden = true;
}

/** Controls of which the server knows nothing. */
function watchTools(desk: Desk): void {
  const tolerance = part<HTMLInputElement>("tolerance");
  const show = (): void => {
    desk.tolerance = Number(tolerance.value);
    part("tolerance-text").textContent = tolerance.value;
  };
  tolerance.value = String(desk.tolerance);
  tolerance.addEventListener("input", show);
  show();
  const borders = part<HTMLInputElement>("borders");
  borders.addEventListener("change", () => desk.drawing.setBorders(borders.checked));
}

void start();
