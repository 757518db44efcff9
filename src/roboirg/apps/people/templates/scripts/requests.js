// Requests to our server. One that does not arrive is repeated until it does.

const trouble = byId("trouble");
const complain = (text) => { trouble.textContent = text ?? ""; trouble.hidden = !text; };
const pause = (ms) => new Promise((resolve) => { setTimeout(resolve, ms); });

class Refused extends Error {
  constructor(status, text) {
    super(text);
    this.status = status;
  }
}

/** Send a request; the body is JSON. Raises `Refused` if the server answers but does not agree. */
const ask = async (path, body, headers = {}) => {
  for (;;) {
    let answer = null;
    try {
      answer = await fetch(path, body === undefined ? { headers } : {
        method: "POST", headers: { ...headers, "Content-Type": "application/json" }, body: JSON.stringify(body),
      });
      const text = await answer.text();
      complain(null);
      if (answer.ok) return JSON.parse(text);
      throw new Refused(answer.status, text.trim());
    } catch (error) {
      if (error instanceof Refused && error.status < 500) throw error;
      complain("The server cannot be reached. Nothing is lost; this page goes on as soon as it is back.");
      await pause(1000);
    }
  }
};
