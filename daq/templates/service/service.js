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
        const [length, effort] = (line.units || [])[j] || ["", ""];
        const above = picture(`position, ${length}`, "", ["reference", "position"]);
        const middle = picture(`following error, m${length}`, "strip", ["zero", "effort"]);
        const below = picture(`torque, ${effort}`, "strip", ["zero", "effort"]);
        const axis = document.createElement("div");
        axis.className = "time";
        axis.setAttribute("aria-hidden", "true");
        marks(0, line.duration || 0).forEach((time, k, all) => {
          const label = document.createElement("span");
          label.textContent = written(time, all) + (k === all.length - 1 ? " s" : "");
          label.style.left = `${(100 * time) / (line.duration || 1)}%`;
          if (time > 0.97 * line.duration) label.className = "end";
          axis.append(label);
        });
        figure.append(caption, above.panel, middle.panel, below.panel, axis);
        root.append(figure);
        return { values, above, middle, below, length, effort, rows: [] };
      });
    }

    function picture(words, kind, names) {
      const panel = document.createElement("div");
      panel.className = `panel ${kind}`;
      panel.setAttribute("aria-hidden", "true");
      const svg = document.createElementNS(SVG, "svg");
      svg.setAttribute("viewBox", "0 0 300 100");
      svg.setAttribute("preserveAspectRatio", "none");
      const what = document.createElement("span");
      what.className = "what";
      what.textContent = words;
      const paths = names.map((name) => {
        const path = document.createElementNS(SVG, "path");
        path.setAttribute("class", name);
        svg.append(path);
        return path;
      });
      panel.append(svg, what);
      return { panel, paths, lines: [] };
    }

    // Round numbers between two, three to six of them.
    function marks(low, high) {
      if (!(high > low)) return [low];
      const power = 10 ** Math.floor(Math.log10(high - low));
      const step = [0.1, 0.2, 0.5, 1, 2, 5].map((k) => k * power).find((k) => (high - low) / k <= 5);
      const found = [];
      for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) found.push(k * step);
      return found;
    }

    // With as many decimals as the step between marks needs, so that no two read the same.
    function written(value, all) {
      const step = all.length > 1 ? all[1] - all[0] : Math.abs(value) || 1;
      return value.toFixed(Math.min(12, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)))).replace("-", "−");
    }

    // Columns of rows over the share of the run that is done, with marks of the range that they have.
    function draw(shown, rows, columns, least) {
      const values = rows.flatMap((row) => columns.map((column) => row[column]));
      let low = Math.min(...values, ...least);
      let high = Math.max(...values, ...least);
      const margin = 0.06 * (high - low) || Math.abs(high) || 1;
      low -= margin;
      high += margin;
      const height = (value) => (100 * (high - value)) / (high - low);
      columns.forEach((column, k) => {
        const points = rows.map((row) => `${((300 * row[0]) / cycles).toFixed(1)} ${height(row[column]).toFixed(2)}`);
        shown.paths[shown.paths.length - columns.length + k].setAttribute("d", `M${points.join("L")}`);
      });
      const all = marks(low, high);
      shown.lines.forEach((line) => line.remove());
      shown.lines = all.map((value) => {
        const line = document.createElement("div");
        line.className = "grid";
        line.style.top = `${height(value)}%`;
        const label = document.createElement("span");
        label.textContent = written(value, all);
        line.append(label);
        shown.panel.append(line);
        return line;
      });
      return height(0);
    }

    function samples(line) {
      document.getElementById("live-progress").value = line.cycle / cycles;
      text("live-time", `${line.time.toFixed(1)} s`);
      text("live-missed", String(line.missed));
      text("live-incomplete", String(line.incomplete));
      joints.forEach((joint, j) => {
        const { rows, above, middle, below, values } = joint;
        const error = 1000 * (line.reference[j] - line.position[j]);
        rows.push([line.cycle, line.reference[j], line.position[j], error, line.torque[j]]);
        if (rows.length > MOST) joint.rows = rows.filter((row, k) => k % 2 === 0);  // a long run, drawn coarser
        const words = (value, decimals, unit) => `${value.toFixed(decimals).replace("-", "−")} ${unit}`;
        values[0].textContent = words(line.position[j], 4, joint.length);
        values[1].textContent = words(error, 2, `m${joint.length}`);
        values[2].textContent = words(line.torque[j], 2, joint.effort);
        draw(above, rows, [1, 2], []);
        for (const [shown, column] of [[middle, 3], [below, 4]]) {
          const zero = draw(shown, rows, [column], [0]);
          shown.paths[0].setAttribute("d", `M0 ${zero.toFixed(2)}H300`);
        }
      });
    }
  }
})();
