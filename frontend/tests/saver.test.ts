import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Api } from "../src/studio/session/api";
import { newStrokeId, Saver } from "../src/studio/session/saver";
import { FakeServer, fakeStorage } from "./fake";

let server: FakeServer;
const listener = { saved: vi.fn(), refused: vi.fn(), gone: vi.fn() };

beforeEach(() => {
  vi.useFakeTimers();
  server = new FakeServer();
});

afterEach(() => {
  vi.clearAllMocks();
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

const open = (key = "file"): Saver => new Saver(new Api("token"), "/api/files/0", key, listener);

const stroke = (paint: number, ...cells: number[]): { paint: number; cells: Uint32Array; strokeId: string } =>
  ({ paint, cells: Uint32Array.from(cells), strokeId: newStrokeId() });

test("a stroke is stored before it is sent, and until it is saved", async () => {
  server.mode = "wait";
  const saver = open();
  saver.add(stroke(1, 2, 3));
  expect(Object.keys(localStorage)).toHaveLength(1);
  server.answer();
  await saver.flush();
  expect(server.paint[0].slice(0, 4)).toEqual([0, 0, 1, 1]);
  expect(Object.keys(localStorage)).toEqual([]);
  expect(listener.saved).toHaveBeenCalledOnce();
});

test("a request to a hung server ends after ten seconds, and the stroke waits", async () => {
  server.mode = "hangs";
  const saver = open();
  saver.add(stroke(1, 2));
  await vi.advanceTimersByTimeAsync(9_900);
  expect(listener.gone).not.toHaveBeenCalled();
  await vi.advanceTimersByTimeAsync(200);
  expect(listener.gone).toHaveBeenCalledOnce();
  expect(saver.count).toBe(1);
});

test("the next page sends what the last one could not, in order, and nothing twice", async () => {
  server.mode = "hangs";
  const closed = open();
  for (let number = 1; number <= 6; number++) closed.add(stroke(number, number, 0));
  server.take(server.paint[0], server.requests[0].body); // the server goes on, and the page is gone
  server.paint[0][1] = 0; // undone in another page
  server.mode = "answers";
  const saver = open();
  expect(saver.count).toBe(6);
  await saver.flush();
  expect(server.paint[0].slice(0, 7)).toEqual([6, 0, 2, 3, 4, 5, 6]);
  expect(Object.keys(localStorage)).toEqual([]);
});

test("parts that were sent together are sent together again, without parts added later", async () => {
  server.mode = "fails";
  const saver = open();
  const { strokeId } = stroke(1);
  for (const cell of [1, 2]) saver.add({ paint: 1, cells: Uint32Array.of(cell), strokeId });
  await saver.flush();
  await saver.flush();
  saver.add({ paint: 1, cells: Uint32Array.of(3), strokeId });
  server.mode = "answers";
  await vi.advanceTimersByTimeAsync(0);
  await saver.flush();
  const parts = server.requests.map(({ body }) => [body.part, body.cells]);
  const tried = new Map<unknown, Set<unknown>>();
  for (const [part, cells] of parts) tried.set(part, (tried.get(part) ?? new Set()).add(cells));
  expect([...tried.values()].every((cells) => cells.size === 1)).toBe(true);
  expect(server.paint[0].slice(1, 4)).toEqual([1, 1, 1]);
});

test("a refused stroke is dropped, and a full disk or another token keeps it", async () => {
  const saver = open();
  server.mode = { status: 400 };
  saver.add(stroke(1, 2));
  await saver.flush();
  expect(listener.refused).toHaveBeenCalledOnce();
  expect([saver.count, Object.keys(localStorage)]).toEqual([0, []]);
  for (const status of [403, 507]) {
    server.mode = { status };
    saver.add(stroke(1, status % 8));
    await saver.flush();
  }
  expect(listener.gone).toHaveBeenCalledTimes(2);
  server.mode = "answers";
  await saver.flush();
  expect(server.paint[0][3]).toBe(1);
  expect(saver.count).toBe(0);
});

test("strokes of another file stay stored", async () => {
  server.mode = "fails";
  open("one").add(stroke(1, 2));
  server.mode = "answers";
  await open("other").flush();
  expect(Object.keys(localStorage)).toHaveLength(1);
  expect(server.sent("paint")).toHaveLength(1);
});

test("a full storage is noticed, and the stroke is sent nevertheless", async () => {
  vi.stubGlobal("localStorage", fakeStorage(10));
  server.mode = "fails";
  const saver = open();
  saver.add(stroke(1, 2));
  await saver.flush();
  expect(saver.isKept).toBe(false);
  server.mode = "answers";
  await saver.flush();
  expect([saver.isKept, server.paint[0][2]]).toEqual([true, 1]);
});

test("a stroke that is added when the last answer arrives is sent, too", async () => {
  const saver = open();
  listener.saved.mockImplementationOnce(() => void Promise.resolve().then(() => saver.add(stroke(2, 5))));
  saver.add(stroke(1, 4));
  await vi.advanceTimersByTimeAsync(10);
  expect(server.paint[0].slice(4, 6)).toEqual([1, 2]);
  expect(saver.count).toBe(0);
});

test("a long request ends only if the server does not deliver its page either", async () => {
  const api = new Api("token");
  server.mode = "wait";
  const done = vi.fn();
  void api.get("/api/files/0/state").then(done, done);
  server.mode = "answers"; // for probes
  await vi.advanceTimersByTimeAsync(60_000);
  expect(done).not.toHaveBeenCalled();
  server.mode = "hangs";
  vi.spyOn(AbortSignal, "timeout").mockImplementation((ms) => {
    const controller = new AbortController();
    setTimeout(() => controller.abort(), ms);
    return controller.signal;
  });
  await vi.advanceTimersByTimeAsync(21_000);
  expect(String(done.mock.calls[0]?.[0])).toContain("the server does not answer");
});
