"use strict";
(() => {
  const root = document.getElementById("live");
  if (root) look(root);
  const form = document.getElementById("drive-form");
  if (form) form.addEventListener("submit", drive);

  async function drive(event) {
    event.preventDefault();
    const said = document.getElementById("drive-said");
    const data = new FormData(form);
    const answer = await fetch(`/api/fleet/${encodeURIComponent(data.get("place"))}/check`, {
      method: "POST",
      headers: { Authorization: `Bearer ${data.get("token")}` },
    });
    const content = await answer.json();
    const detail = typeof content.detail === "string" ? content.detail : "refused";
    said.textContent = answer.ok ? `Check ${content.job} of ${content.robot} has begun.` : detail;
    form.elements.token.value = "";
  }

  function look(root) {
    const MOST = 300;
    const text = (id, value) => { document.getElementById(id).textContent = value; };
    let joints = [];
    let cycles = 1;
    let begun = false;
    const source = new EventSource(`/api/runs/${root.dataset.run}/live`);
    source.onmessage = (event) => {
      const line = JSON.parse(event.data);
      if (line.kind === "begin") begin(line);
      else if (line.kind === "samples" && begun) samples(line);
      else if (line.kind === "end") over(line.outcome);
    };
    source.addEventListener("over", () => over(""));
    source.onerror = () => { if (source.readyState === EventSource.CLOSED) text("live-state", "nothing to look at"); };

    function over(outcome) {
      source.close();
      text("live-state", outcome ? `over: ${outcome}` : "over");
    }

    function begin(line) {
      begun = true;
      cycles = line.cycles;
      text("live-state", line.title);
      root.replaceChildren();
      joints = line.joints.map((name) => {
        const figure = document.createElement("figure");
        figure.className = "card live-joint";
        const caption = document.createElement("figcaption");
        const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
        svg.setAttribute("viewBox", "0 0 300 100");
        svg.setAttribute("preserveAspectRatio", "none");
        svg.setAttribute("aria-hidden", "true");
        const paths = ["position", "reference"].map((kind) => {
          const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
          path.setAttribute("class", kind);
          svg.append(path);
          return path;
        });
        figure.append(caption, svg);
        root.append(figure);
        return { name, caption, paths, rows: [] };
      });
    }

    function samples(line) {
      document.getElementById("live-progress").value = line.cycle / cycles;
      text("live-time", `${line.time.toFixed(1)} s`);
      text("live-missed", String(line.missed));
      text("live-incomplete", String(line.incomplete));
      joints.forEach((joint, j) => {
        joint.rows.push([line.position[j], line.reference[j]]);
        if (joint.rows.length > MOST) joint.rows.shift();
        const error = 1000 * (line.reference[j] - line.position[j]);
        joint.caption.textContent =
          `${joint.name}: ${line.position[j].toFixed(4)}, following error ${error.toFixed(2)}e-3, torque ${line.torque[j].toFixed(2)}`;
        const all = joint.rows.flat();
        const low = Math.min(...all);
        const span = Math.max(...all) - low || 1;
        joint.paths.forEach((path, k) => {
          const points = joint.rows.map((row, i) => `${i} ${(95 - (90 * (row[k] - low)) / span).toFixed(2)}`);
          path.setAttribute("d", `M${points.join("L")}`);
        });
      });
    }
  }
})();
