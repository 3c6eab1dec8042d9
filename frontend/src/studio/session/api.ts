// Requests to the studio server.

import { text } from "../text/index";

/** The server rejected a request. The error has the message and the HTTP status of the response. */
export class ServerError extends Error {
  constructor(message: string, readonly status: number) {
    super(message);
  }

  /** Whether the same request may succeed later: the token is wrong, or the server cannot write its file. */
  get isTemporary(): boolean {
    return this.status === 403 || this.status === 507;
  }
}

/** The server does not respond. */
export class ServerGone extends Error {
  constructor() {
    super(text.session.gone);
  }
}

async function refusal(response: Response): Promise<ServerError> {
  const body = (await response.json().catch(() => null)) as { error?: string } | null;
  const line = body?.error ?? `${response.status} ${response.statusText}`;
  return new ServerError(line, response.status);
}

const ANSWER_MS = 10_000; // time that the server has to answer a short request or a probe

/** A long request may take any time while the server answers probes. A short request may not. */
type Length = "short" | "long";

export class Api {
  constructor(private readonly token: string) {}

  /**
   * URL for links and images. The browser requests these URLs without the header that contains the token, so the query
   * contains the token.
   */
  address(path: string, query: Record<string, string> = {}): string {
    return `${path}?${new URLSearchParams({ ...query, token: this.token }).toString()}`;
  }

  private async send(path: string, body: unknown, signal: AbortSignal): Promise<Response> {
    const headers = { "X-Token": this.token, "Content-Type": "application/json" };
    const given = body === undefined ? {} : { method: "POST", body: JSON.stringify(body) };
    const response = await fetch(path, { ...given, headers, cache: "no-store", signal });
    if (!response.ok) throw await refusal(response);
    return response;
  }

  /** Whether the server delivers its page, which never waits for an operation on a file. */
  private isAlive(): Promise<boolean> {
    const options = { method: "HEAD", headers: { "X-Token": this.token }, signal: AbortSignal.timeout(ANSWER_MS) };
    return fetch("/", options).then(() => true, () => false);
  }

  /** Returns a signal that aborts a request if the server hangs or the user cancels, and a function that aborts it. */
  private watch(length: Length, cancelled?: AbortSignal): { signal: AbortSignal; end: () => void } {
    const controller = new AbortController();
    const check = async (): Promise<void> => {
      if (length === "short" || !(await this.isAlive())) controller.abort();
    };
    const timer = setInterval(() => void check(), ANSWER_MS);
    const end = (): void => {
      clearInterval(timer);
      controller.abort();
    };
    cancelled?.addEventListener("abort", end);
    return { signal: controller.signal, end };
  }

  private async request<T>(path: string, body: unknown, length: Length, read: (response: Response) => Promise<T>): Promise<T> {
    const { signal, end } = this.watch(length);
    try {
      return await read(await this.send(path, body, signal));
    } catch (error) {
      throw error instanceof ServerError ? error : new ServerGone();
    } finally {
      end();
    }
  }

  get<T>(path: string, length: Length = "long"): Promise<T> {
    return this.request(path, undefined, length, (response) => response.json() as Promise<T>);
  }

  post<T>(path: string, body: unknown = {}, length: Length = "long"): Promise<T> {
    return this.request(path, body, length, (response) => response.json() as Promise<T>);
  }

  buffer(path: string): Promise<ArrayBuffer> {
    return this.request(path, undefined, "long", (response) => response.arrayBuffer());
  }

  /** Values of a streamed response that has one JSON value per line. */
  async *lines<T>(path: string, body: unknown, cancelled: AbortSignal): AsyncGenerator<T> {
    const { signal, end } = this.watch("long", cancelled);
    try {
      const response = await this.send(path, body, signal);
      const reader = response.body!.pipeThrough(new TextDecoderStream()).getReader();
      let rest = "";
      for (;;) {
        const { done, value } = await reader.read();
        const parts = (rest + (value ?? "")).split("\n");
        rest = parts.pop()!;
        for (const part of parts) if (part.trim()) yield JSON.parse(part) as T;
        if (done) break;
      }
      if (rest.trim()) yield JSON.parse(rest) as T;
    } catch (error) {
      throw error instanceof ServerError || cancelled.aborted ? error : new ServerGone();
    } finally {
      end();
    }
  }
}
