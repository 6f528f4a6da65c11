// The state of the service and its API. Text of the service is only ever set as text.
const $ = (id) => document.getElementById(id);
let token = "";

async function get(path) {
  const headers = token ? { authorization: `Bearer ${token}` } : {};
  const response = await fetch(path, { headers });
  if (response.status === 401) throw new Error("token");
  return response.json();
}

function row(cells, kind) {
  const tr = document.createElement("tr");
  for (const text of cells) tr.append(Object.assign(document.createElement("td"), { textContent: text }));
  if (kind) tr.className = kind;
  return tr;
}

function bodyOf(operation) {
  const schema = operation.requestBody?.content["application/json"].schema;
  const refs = schema ? (schema.anyOf ?? [schema]) : [];
  return refs.map((ref) => ref.$ref.split("/").pop()).join(" or ");
}

function operations(paths) {
  return Object.entries(paths).flatMap(([path, item]) =>
    ["get", "post", "delete"].filter((method) => item[method]).map((method) =>
      row([`${method.toUpperCase()} ${path}`, item[method].summary, bodyOf(item[method])])));
}

async function show() {
  try {
    const health = await get("/healthz");
    $("state").textContent = `${health.ready ? "Ready" : "Preparing maps"}: ${health.prepared} of ` +
      `${health.maps} maps prepared, ${health.faults} unusable, ${health.robots} robots, ` +
      `${health.waiting} queries run or wait. Version ${health.version}.`;
    const maps = await get("/v1/maps"); // asks for the token, if one is needed
    const [robots, api] = await Promise.all(["/v1/robots", "/openapi.json"].map(get));
    $("maps").replaceChildren(...maps.maps.map((map) =>
      row([map.map_id, map.fault ?? (map.ready ? "ready" : "is prepared")], map.fault && "fault")));
    $("robots").textContent = robots.robots.join(", ") || "None has reported.";
    $("api").replaceChildren(...operations(api.paths));
    $("access").hidden = true;
    $("contents").hidden = false;
  } catch (error) {
    if (error.message !== "token") $("state").textContent = "The service does not answer.";
    else $("access").hidden = false;
  }
}

$("access").addEventListener("submit", (event) => {
  event.preventDefault();
  token = $("token").value;
  show();
});
show();
setInterval(() => { if ($("access").hidden) show(); }, 2000);
