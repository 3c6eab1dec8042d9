// Arrays of whole numbers as text, little-endian.

const CHUNK = 0x8000; // arguments of one call

export function toBase64(numbers: Uint32Array | Uint8Array): string {
  const bytes = new Uint8Array(numbers.buffer, numbers.byteOffset, numbers.byteLength);
  let text = "";
  for (let start = 0; start < bytes.length; start += CHUNK) {
    text += String.fromCharCode(...bytes.subarray(start, start + CHUNK));
  }
  return btoa(text);
}

function bytesOf(text: string): ArrayBuffer {
  const characters = atob(text);
  const bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = characters.charCodeAt(i);
  return bytes.buffer;
}

export function uint32FromBase64(text: string): Uint32Array {
  return new Uint32Array(bytesOf(text));
}

export function uint16FromBase64(text: string): Uint16Array {
  return new Uint16Array(bytesOf(text));
}
