// Texts in the browser's local storage, which the user may have disabled.

function tried<T>(run: () => T, otherwise: T): T {
  try {
    return run();
  } catch {
    return otherwise;
  }
}

export const remembered = (key: string): string | null => tried(() => localStorage.getItem(key), null);

/** A value that was stored as JSON; null if there is none, or if it is damaged. */
export const rememberedValue = <T>(key: string): T | null => tried(() => JSON.parse(remembered(key) ?? "null") as T | null, null);

/** Keys of stored texts that begin with a prefix, in alphabetical order. */
export const rememberedKeys = (prefix: string): string[] =>
  tried(() => Object.keys(localStorage).filter((key) => key.startsWith(prefix)).sort(), []);

/** Store a text, or remove the stored text if `text` is null. Returns false if the storage is full or disabled. */
export const remember = (key: string, text: string | null): boolean => tried(() => {
  if (text === null) localStorage.removeItem(key);
  else localStorage.setItem(key, text);
  return true;
}, false);
