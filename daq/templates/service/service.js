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
    if (answer.ok) follow(said, content.job, content.robot);
  }

  // Where the check can be looked at, as soon as it moves, and how it ended.
  async function follow(said, number, robot) {
    const get = async (path) => (await fetch(path)).json();
    const verdicts = ["fine", "a warning", "failed or refused", "not measurable"];
    for (let shown = ""; ; await new Promise((done) => setTimeout(done, 1000))) {
      const job = (await get("/api/jobs")).find((one) => one.job === number);
      const run = (await get("/api/runs?limit=5")).find((one) => one.started >= job.started);
      const ended = job.exit_code !== null;
      const text = ended
        ? `Check ${number} of ${robot} has ended: ${verdicts[job.exit_code] || "stopped"}.`
        : `Check ${number} of ${robot} has begun.`;
      const link = document.createElement("a");
      link.textContent = ended ? "To the run" : "Look on";
      link.href = run ? `/runs/${run.number}${ended ? "" : "/live"}` : "";
      const state = text + link.href;
      if (state !== shown) said.replaceChildren(text, ...(run ? [" ", link] : []));
      shown = state;
      if (ended) return;
    }
  }

  function look(root) {
    const MOST = 600;
    const SVG = "http://www.w3.org/2000/svg";
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
      joints = line.joints.map((name, j) => {
        const figure = document.createElement("figure");
        figure.className = "card live-joint";
        const caption = document.createElement("figcaption");
        const heading = document.createElement("b");
        heading.textContent = name;
        const numbers = document.createElement("dl");
        const values = ["position", "following error", "torque"].map((word) => {
          const [part, term, value] = ["div", "dt", "dd"].map((tag) => document.createElement(tag));
          term.textContent = word;
          part.append(term, value);
          numbers.append(part);
          return value;
        });
        caption.append(heading, numbers);
        const above = picture("", ["position", "reference"]);
        const below = picture("torque", ["zero", "effort"]);
        figure.append(caption, above.svg, below.svg);
        root.append(figure);
        const [length, effort] = (line.units || [])[j] || ["", ""];
        return { values, above, below, length, effort, rows: [] };
      });
    }

    function picture(kind, names) {
      const svg = document.createElementNS(SVG, "svg");
      svg.setAttribute("class", kind);
      svg.setAttribute("viewBox", "0 0 300 100");
      svg.setAttribute("preserveAspectRatio", "none");
      svg.setAttribute("aria-hidden", "true");
      const paths = names.map((name) => {
        const path = document.createElementNS(SVG, "path");
        path.setAttribute("class", name);
        svg.append(path);
        return path;
      });
      return { svg, paths };
    }

    // Columns of rows over the share of the run that is done, in the range that they have.
    function draw(paths, rows, columns, range) {
      const low = Math.min(...range);
      const span = Math.max(...range) - low || 1;
      columns.forEach((column, k) => {
        const points = rows.map((row) => {
          const height = 95 - (90 * (row[column] - low)) / span;
          return `${((300 * row[0]) / cycles).toFixed(1)} ${height.toFixed(2)}`;
        });
        paths[k].setAttribute("d", `M${points.join("L")}`);
      });
      return 95 + (90 * low) / span;
    }

    function samples(line) {
      document.getElementById("live-progress").value = line.cycle / cycles;
      text("live-time", `${line.time.toFixed(1)} s`);
      text("live-missed", String(line.missed));
      text("live-incomplete", String(line.incomplete));
      joints.forEach((joint, j) => {
        const { rows, above, below, values } = joint;
        rows.push([line.cycle, line.position[j], line.reference[j], line.torque[j]]);
        if (rows.length > MOST) joint.rows = rows.filter((row, k) => k % 2 === 0);  // a long run, drawn coarser
        const error = 1000 * (line.reference[j] - line.position[j]);
        values[0].textContent = `${line.position[j].toFixed(4)} ${joint.length}`;
        values[1].textContent = `${error.toFixed(2)} m${joint.length}`;
        values[2].textContent = `${line.torque[j].toFixed(2)} ${joint.effort}`;
        draw(above.paths, rows, [1, 2], rows.flatMap((row) => [row[1], row[2]]));
        const zero = draw(below.paths.slice(1), rows, [3], [0, ...rows.map((row) => row[3])]);
        below.paths[0].setAttribute("d", `M0 ${zero.toFixed(2)}H300`);
      });
    }
  }
})();
