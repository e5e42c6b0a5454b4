/*<![CDATA[*/
"use strict";
// Pictures over time: a cursor with the values below it, and zoom along the time axis. Without a browser that runs
// this the pictures are whole as they are. Drag, or + and −, zooms; double click or Escape shows all again.
(() => {
  const WIDTH = 1000;
  const HEIGHT = 400;
  const figures = document.querySelectorAll("figure.traces");
  const keys = document.createElement("p");
  keys.id = "keys-of-pictures";
  keys.hidden = true;
  keys.textContent = "Arrow keys move a cursor, plus and minus zoom, Escape shows all";
  if (figures.length) document.body.append(keys);
  for (const figure of figures) trace(figure);

  function trace(figure) {
    const [t0, t1] = figure.dataset.span.split(" ").map(Number);
    const frame = figure.querySelector("[role=img]");
    const axis = figure.querySelector(".time");
    const panels = [...figure.querySelectorAll(".panel")].map((element) => {
      const line = document.createElement("div");
      line.className = "cursor";
      line.hidden = true;
      element.append(line);
      return {
        element,
        line,
        svg: element.querySelector("svg"),
        limits: element.dataset.limits.split(" ").map(Number),
        names: element.dataset.names.split("|"),
        starts: [...element.querySelectorAll(".start")].map((mark) => [mark, parseFloat(mark.style.left)]),
        paths: null,
      };
    });
    const said = document.createElement("output");
    said.className = "reading";
    figure.append(said);
    const all = axis.innerHTML;
    let from = 0;
    let to = 1;
    let at = null;
    let dragged = null;
    frame.tabIndex = 0;
    frame.setAttribute("aria-describedby", keys.id);

    // Share of the whole time at a place of the pointer.
    const share = (event) => {
      const box = panels[0].element.getBoundingClientRect();
      return from + (to - from) * Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
    };
    frame.addEventListener("pointerdown", (event) => { dragged = share(event); });
    frame.addEventListener("pointermove", (event) => show(share(event)));
    frame.addEventListener("pointerleave", () => { dragged = null; show(null); });
    frame.addEventListener("pointerup", (event) => {
      const end = share(event);
      if (dragged !== null && Math.abs(end - dragged) > 0.02 * (to - from)) window_(Math.min(dragged, end), Math.max(dragged, end));
      dragged = null;
    });
    frame.addEventListener("dblclick", () => window_(0, 1));
    frame.addEventListener("keydown", (event) => {
      const step = (to - from) * (event.shiftKey ? 0.1 : 0.01);
      const here = at === null ? (from + to) / 2 : at;
      const half = (to - from) / 2;
      if (event.key === "ArrowRight") show(Math.min(to, here + step));
      else if (event.key === "ArrowLeft") show(Math.max(from, here - step));
      else if (event.key === "+") window_(here - half / 2, here + half / 2);
      else if (event.key === "-") window_(here - half * 2, here + half * 2);
      else if (event.key === "Escape") { window_(0, 1); show(null); }
      else return;
      event.preventDefault();
    });

    function window_(low, high) {
      if (high - low < 1e-4) return;
      const wide = Math.min(1, high - low);
      from = Math.min(Math.max(0, low), 1 - wide);
      to = from + wide;
      for (const { svg, starts } of panels) {
        svg.setAttribute("viewBox", `${WIDTH * from} 0 ${WIDTH * (to - from)} ${HEIGHT}`);
        for (const [mark, left] of starts) {
          const place = (left / 100 - from) / (to - from);
          mark.style.left = `${100 * place}%`;
          mark.hidden = place < 0 || place > 1;
        }
      }
      if (from === 0 && to === 1) axis.innerHTML = all;
      else axis.replaceChildren(...labels(t0 + from * (t1 - t0), t0 + to * (t1 - t0)));
      show(at);
    }

    // Round times between two, at most six.
    function labels(low, high) {
      const power = 10 ** Math.floor(Math.log10(high - low));
      const step = [0.1, 0.2, 0.5, 1, 2, 5].map((k) => k * power).find((k) => (high - low) / k <= 6);
      const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
      const found = [];
      for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) {
        const label = document.createElement("span");
        const place = (100 * (k * step - low)) / (high - low);
        label.textContent = (k * step).toFixed(digits);
        label.style.left = `${place}%`;
        if (place > 97) label.className = "end";
        found.push(label);
      }
      if (found.length) found[found.length - 1].textContent += " s";
      return found;
    }

    function show(where) {
      at = where;
      const visible = at !== null && at >= from && at <= to;
      const parts = [];
      for (const panel of panels) {
        panel.line.hidden = !visible;
        if (!visible) continue;
        panel.line.style.left = `${(100 * (at - from)) / (to - from)}%`;
        panel.paths = panel.paths || [...panel.svg.querySelectorAll("path")].map(corners);
        panel.paths.forEach((path, k) => {
          const height = between(path, at * WIDTH);
          const [low, high] = panel.limits;
          if (height !== null) parts.push(`${panel.names[k]} ${number(high - (height / HEIGHT) * (high - low), high - low)}`);
        });
      }
      const time = visible ? `${(t0 + at * (t1 - t0)).toFixed(3)} s: ` : "";
      said.textContent = visible ? time + parts.join(", ") + ` ${figure.dataset.unit}` : "";
    }
  }

  // As many decimals as a thousandth of the axis needs.
  function number(value, span) {
    const digits = Math.min(12, Math.max(0, 3 - Math.floor(Math.log10(span || 1))));
    return value.toFixed(digits).replace("-", "−");
  }

  // Corners of a path of M, m, l, h and v, in plot units; null where the pen is lifted.
  function corners(path) {
    const found = [];
    let [x, y] = [0, 0];
    for (const [, kind, numbers] of path.getAttribute("d").matchAll(/([MmLlHhVv])([^MmLlHhVv]*)/g)) {
      const values = (numbers.match(/-?[0-9.]+/g) || []).map(Number);
      if (kind === "M") [x, y] = values;
      else if (kind === "h") x += values[0];
      else if (kind === "v") y += values[0];
      else { x += values[0]; y += values[1]; }
      if (kind === "m" || kind === "M") found.push(null);
      found.push([x, y]);
    }
    return found;
  }

  // Height of a path at a place, between its corners; null beside it and in its gaps.
  function between(points, place) {
    for (let k = 1; k < points.length; k += 1) {
      const [left, right] = [points[k - 1], points[k]];
      if (!left || !right || place < left[0] || place > right[0]) continue;
      if (right[0] === left[0]) return right[1];
      return left[1] + ((right[1] - left[1]) * (place - left[0])) / (right[0] - left[0]);
    }
    return null;
  }
})();
/*]]>*/
