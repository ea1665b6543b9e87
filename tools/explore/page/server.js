// Requests to the server of `qjulia explore`.

const token = new URLSearchParams(location.search).get("token");
const client = [...crypto.getRandomValues(new Uint8Array(16))].map((byte) => byte.toString(16).padStart(2, "0")).join("");

/** @param options those of fetch, and `as`: who asks, besides the page itself. */
async function fetched(path, query, { as = "", ...options }) {
  const headers = { "X-Qjulia-Token": token, "X-Qjulia-Client": client + as };
  const answer = await fetch(`${path}?${new URLSearchParams(query)}`, { ...options, headers }).catch((error) => {
    // So browsers say that nobody listens.
    throw error instanceof TypeError ? new Error("the server has ended; its terminal says why") : error;
  });
  if (!answer.ok) throw new Error((await answer.text()).trim());
  return answer;
}

/** What a path tells at once. */
export const asked_json = async (path, method = "GET", query = {}) => (await fetched(path, query, { method })).json();

function joined(a, b) {
  const both = new Uint8Array(a.length + b.length);
  both.set(a), both.set(b, a.length);
  return both;
}

/** The bytes that the device makes, as a Blob; null where another request came in between.
 * @param report gets how much is done, 0 ... 1, and a text. */
export async function ask(path, query, { report, ...options } = {}) {
  const reader = (await fetched(path, query, options)).body.getReader();
  const words = new TextDecoder(), line = "~".charCodeAt(0), parts = [];
  let kind = "", begin = new Uint8Array();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    if (kind !== "") {
      parts.push(value);
      continue;
    }
    begin = joined(begin, value);
    for (let end = begin.indexOf(10); begin[0] === line && end >= 0; end = begin.indexOf(10)) {
      const [share, ...text] = words.decode(begin.subarray(1, end)).split(" ");
      report?.(Number(share), text.join(" "));
      begin = begin.subarray(end + 1);
    }
    if (begin.length === 0 || begin[0] === line) continue;
    kind = String.fromCharCode(begin[0]);
    parts.push(begin.subarray(1));
  }
  const bytes = new Blob(parts);
  if (kind === "!") throw new Error(await bytes.text());
  if (kind === "") throw new Error("the server has ended");
  return kind === "=" ? bytes : null;
}
