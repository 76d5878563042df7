// The browser's side of `mutual_proof.py`: page and browser prove to each other that they have the key; it is never sent.
const hex = (bytes) => Array.from(new Uint8Array(bytes), (byte) => byte.toString(16).padStart(2, "0")).join("");

export const nonce = () => hex(crypto.getRandomValues(new Uint8Array(16)));

export async function proof(key, side, host, browserNonce, pageNonce) {
  const utf8 = new TextEncoder();
  const secret = await crypto.subtle.importKey("raw", utf8.encode(key), { name: "HMAC", hash: "SHA-256" }, false, ["sign"]);
  return hex(await crypto.subtle.sign("HMAC", secret, utf8.encode([side, host, browserNonce, pageNonce].join("\n"))));
}
