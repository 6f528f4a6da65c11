/** Save the last seconds of the robot, and download them. */

import { authorization } from "./token.js";

const byId = (id) => document.getElementById(id);
const SHOWN = 3;

/** Offer the button, from `hello`; the list where there is one. */
export function offerIncidents({ robot, may_steer: maySteer }, notices) {
  const isOffered = maySteer && robot !== "replay";
  byId("incidents").hidden = !isOffered;
  byId("save-incident").onclick = isOffered ? () => save(notices) : null;
}

async function save(notices) {
  try {
    const answer = await fetch("/v1/incidents", { method: "POST", headers: authorization() });
    if (!answer.ok) throw new Error((await answer.json().catch(() => null))?.detail);
    await list(notices);
  } catch (error) {
    notices.showError(error.message || "The last seconds could not be saved.");
  }
}

async function list(notices) {
  const answer = await fetch("/v1/incidents", { headers: authorization() });
  const { incidents } = await answer.json();
  byId("incidents-list").replaceChildren(
    ...incidents.slice(0, SHOWN).map(({ name, saved_at: at, cause, url }) => {
      const line = document.createElement("li");
      const button = document.createElement("button");
      button.type = "button";
      button.className = "chip";
      button.textContent = `${cause}, ${new Date(at).toLocaleTimeString()}`;
      button.title = `Download ${name}`;
      button.onclick = () => download(name, url, notices);
      line.append(button);
      return line;
    }),
  );
}

/** A plain link would not carry the token. */
async function download(name, url, notices) {
  const answer = await fetch(url, { headers: authorization() }).catch(() => null);
  if (!answer?.ok) {
    notices.showError("The incident could not be downloaded. It may have been removed.");
    return;
  }
  const link = document.createElement("a");
  link.href = URL.createObjectURL(await answer.blob());
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}
