// Requests to the studio server.

/** The server rejected a request. The error has the message and the HTTP status of the response. */
export class ServerError extends Error {
  constructor(message: string, readonly status: number) {
    super(message);
  }
}

/** The server does not respond. */
export class ServerGone extends Error {
  constructor() {
    super("the server does not answer");
  }
}

async function refusal(response: Response): Promise<ServerError> {
  const body = (await response.json().catch(() => null)) as { error?: string } | null;
  const line = body?.error ?? `${response.status} ${response.statusText}`;
  return new ServerError(line, response.status);
}

export class Api {
  constructor(private readonly token: string) {}

  /**
   * URL for links and images. The browser requests these URLs without the header that contains the token, so the query
   * contains the token.
   */
  address(path: string, query: Record<string, string> = {}): string {
    return `${path}?${new URLSearchParams({ ...query, token: this.token })}`;
  }

  private async request(path: string, options: RequestInit): Promise<Response> {
    const headers: Record<string, string> = { "X-Token": this.token };
    if (options.body !== undefined) headers["Content-Type"] = "application/json";
    let response: Response;
    try {
      response = await fetch(path, { ...options, headers, cache: "no-store" });
    } catch (error) {
      if (options.signal?.aborted) throw error;
      throw new ServerGone();
    }
    if (!response.ok) throw await refusal(response);
    return response;
  }

  async get<T>(path: string): Promise<T> {
    return (await (await this.request(path, {})).json()) as T;
  }

  async post<T>(path: string, body: unknown = {}): Promise<T> {
    const options = { method: "POST", body: JSON.stringify(body) };
    return (await (await this.request(path, options)).json()) as T;
  }

  async buffer(path: string): Promise<ArrayBuffer> {
    const response = await this.request(path, {});
    try {
      return await response.arrayBuffer();
    } catch {
      throw new ServerGone(); // the connection broke in the middle of the response
    }
  }

  /** Values of a streamed response that has one JSON value per line. */
  async *lines<T>(path: string, body: unknown, signal: AbortSignal): AsyncGenerator<T> {
    const options = { method: "POST", body: JSON.stringify(body), signal };
    const response = await this.request(path, options);
    const reader = response.body!.pipeThrough(new TextDecoderStream()).getReader();
    let rest = "";
    for (;;) {
      const { done, value } = await reader.read().catch((error: unknown) => {
        throw signal.aborted ? error : new ServerGone();
      });
      const parts = (rest + (value ?? "")).split("\n");
      rest = parts.pop()!;
      for (const part of parts) if (part.trim()) yield JSON.parse(part) as T;
      if (done) break;
    }
    if (rest.trim()) yield JSON.parse(rest) as T;
  }
}
