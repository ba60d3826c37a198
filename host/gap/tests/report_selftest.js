// Runs in the example report, in a browser: drags and clicks like a reader and writes what came
// out into data-selftest, where the Rust test reads it.
(async function () {
  const root = document.documentElement;
  const wait = () => new Promise(done => setTimeout(done, 60));
  const check = (ok, text) => { if (!ok) throw new Error(text); };
  const close = (a, b, part) => Math.abs(a - b) <= part * Math.max(Math.abs(a), Math.abs(b), 1e-9);

  // Moves by parts of the plot; a real drag comes as several moves.
  async function drag(p, from, to) {
    const over = p.u.over;
    p.u.root.scrollIntoView();
    await wait();
    const r = over.getBoundingClientRect();
    const at = f => ({ clientX: r.left + f[0] * r.width, clientY: r.top + f[1] * r.height,
      movementX: 5, movementY: 5, button: 0, bubbles: true, cancelable: true, view: window });
    over.dispatchEvent(new MouseEvent("mouseenter", at(from)));
    over.dispatchEvent(new MouseEvent("mousemove", at(from)));
    over.dispatchEvent(new MouseEvent("mousedown", at(from)));
    for (const k of [0.3, 0.7, 1]) {
      over.dispatchEvent(new MouseEvent("mousemove", at([0, 1].map(i => from[i] + (to[i] - from[i]) * k))));
      await wait();
    }
    document.dispatchEvent(new MouseEvent("mouseup", at(to)));
    await wait();
  }
  const doubleClick = async p => {
    p.u.over.dispatchEvent(new MouseEvent("dblclick", { bubbles: true }));
    await wait();
  };
  const range = (p, key) => [p.u.scales[key].min, p.u.scales[key].max];
  const part = (was, now) => (now[1] - now[0]) / (was[1] - was[0]);

  try {
    await wait();
    const { plots } = window.bristlePlots;
    const [a, b] = plots.filter(p => p.group);
    const loop = plots.find(p => !p.group);

    const full = range(a, "x");
    await drag(a, [0.25, 0.5], [0.5, 0.6]);
    check(close(part(full, range(a, "x")), 0.25, 0.03), "a drag shows a quarter: " + range(a, "x"));
    check(String(range(a, "x")) === String(range(b, "x")), "time plots zoom together: " + range(b, "x"));
    await doubleClick(b);
    check(String(range(a, "x")) === String(full), "a double click resets all: " + range(a, "x"));

    const fx = range(loop, "x"), fy = range(loop, "y");
    await drag(loop, [0.2, 0.2], [0.6, 0.7]);
    check(close(part(fx, range(loop, "x")), 0.4, 0.03), "a loop zooms in x: " + range(loop, "x"));
    check(close(part(fy, range(loop, "y")), 0.5, 0.03), "a loop zooms in y: " + range(loop, "y"));
    check(String(range(a, "x")) === String(full), "a loop zooms alone");
    await doubleClick(loop);
    check(close(part(fx, range(loop, "x")), 1, 0.01), "a loop resets in x: " + range(loop, "x"));
    check(close(part(fy, range(loop, "y")), 1, 0.01), "a loop resets in y: " + range(loop, "y"));

    // The pointer in one time plot shows the values in both.
    a.u.root.scrollIntoView();
    await wait();
    const r = a.u.over.getBoundingClientRect();
    const inside = { clientX: r.left + r.width / 4, clientY: r.top + 20, movementX: 1, bubbles: true, cancelable: true };
    a.u.over.dispatchEvent(new MouseEvent("mousemove", inside));
    await wait();
    const values = b.u.root.querySelectorAll(".u-legend .u-value");
    check(/\d/.test(values[1].textContent), "the cursor is shared: " + values[1].textContent);
    const name = b.u.root.querySelectorAll(".u-legend .u-series th")[1];
    name.click();
    await wait();
    check(!b.u.series[1].show, "a click in the legend hides a line");
    name.click();
    await wait();

    a.u.over.dispatchEvent(new WheelEvent("wheel", Object.assign({ deltaY: -300, ctrlKey: true }, inside)));
    await wait();
    check(part(full, range(b, "x")) < 0.7, "the wheel zooms: " + range(b, "x"));
    a.body.parentElement.querySelectorAll("button")[2].click();
    await wait();
    check(String(range(b, "x")) === String(full), "the button resets");
    root.dataset.selftest = "passed";
  } catch (error) {
    root.dataset.selftest = "failed: " + error.message;
  }
})();
