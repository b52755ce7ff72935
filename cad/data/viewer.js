// SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
// SPDX-License-Identifier: Apache-2.0
// Bodies to turn around, in every element of class wedge-view. Works from the disk: the model is a
// script beside the page, fetched when its element comes into view.
"use strict";
(() => {
  const style = document.createElement("style");
  style.textContent = `
    .wedge-view { display: flex; gap: 14px; background: #fff; color: #1c1f24; border: 1px solid #dde; border-radius: 8px; margin: 1rem 0; min-height: 462px; }
    .wedge-view canvas { flex: 1; min-width: 0; height: 460px; cursor: grab; touch-action: pan-y; border-radius: 8px; }
    .wedge-view > div { width: 230px; max-height: 440px; overflow: auto; padding: 10px; font: 13px/1.45 system-ui, sans-serif;
      /* A shade at an edge where the list goes on: its own white, which scrolls along, covers it at the ends. */
      background: linear-gradient(#fff 35%, #fff0) local top / 100% 60px no-repeat, linear-gradient(#fff0, #fff 65%) local bottom / 100% 60px no-repeat,
        linear-gradient(#1c1f2459, #1c1f2400) scroll top / 100% 24px no-repeat, linear-gradient(#1c1f2400, #1c1f2459) scroll bottom / 100% 24px no-repeat; }
    .wedge-view label { display: block; padding: 1px 0; } .wedge-view i { display: inline-block; width: 11px; height: 11px; margin: 0 5px; }
    .wedge-view p { margin: 2rem; }
    @media print { .wedge-view, .wedge-view-use { display: none; } }
    @media (max-width: 760px) { .wedge-view { flex-direction: column; } .wedge-view > div { width: auto; max-height: none; columns: 2; column-gap: 0; } .wedge-view label:first-child { column-span: all; } .wedge-view canvas { flex: none; } }`;
  document.head.append(style);
  const models = window.wedgeModels = window.wedgeModels || {};

  function say(root, text) {
    const words = document.createElement("p");
    words.textContent = text; root.replaceChildren(words);
  }
  function load(root) {
    const script = document.createElement("script");
    script.src = root.dataset.model;
    script.onerror = () => say(root, `${root.dataset.model} is not next to this page, so there is no 3D view.`);
    script.onload = () => show(root, models[root.dataset.name]);
    document.head.append(script);
  }
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
  function shader(gl, type, source) {
    const made = gl.createShader(type); gl.shaderSource(made, source); gl.compileShader(made); return made;
  }
  function show(root, model) {
    const canvas = document.createElement("canvas"), side = document.createElement("div");
    const gl = canvas.getContext("webgl2", {antialias: true});
    if (!gl) return say(root, "This browser has no WebGL 2: look at the pictures instead.");
    canvas.tabIndex = 0; canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `The ${root.dataset.name} sensor; arrow keys rotate it, + and - zoom`);
    const apart = document.createElement("input"), pull = document.createElement("label");
    apart.type = "range"; apart.max = 100; apart.value = 0; apart.name = "apart"; pull.append("pull apart ", apart); side.append(pull);
    root.replaceChildren(canvas, side);
    const program = gl.createProgram();
    gl.attachShader(program, shader(gl, gl.VERTEX_SHADER, `#version 300 es
      in vec3 place; uniform mat4 view; uniform vec3 shift; uniform vec3 low; uniform float step; out vec3 seen;
      void main() { vec4 p = view * vec4(low + step * place + shift, 1.0); seen = p.xyz; gl_Position = p * vec4(1.0, 1.0, -0.2, 1.0); }`));
    gl.attachShader(program, shader(gl, gl.FRAGMENT_SHADER, `#version 300 es
      precision highp float; in vec3 seen; uniform vec3 color; uniform vec2 aspect; out vec4 pixel;
      void main() { vec3 n = normalize(cross(dFdx(seen * vec3(aspect, 1.0)), dFdy(seen * vec3(aspect, 1.0))));
        float light = 0.45 + 0.5 * abs(dot(n, normalize(vec3(0.3, 0.5, 0.8)))); pixel = vec4(color * light + 0.05, 1.0); }`));
    gl.linkProgram(program); gl.useProgram(program); gl.enable(gl.DEPTH_TEST); gl.clearColor(1, 1, 1, 1);
    const at = name => gl.getUniformLocation(program, name), place = gl.getAttribLocation(program, "place");
    gl.uniform3fv(at("low"), model.low); gl.uniform1f(at("step"), model.step);
    for (const body of model.bodies) {
      const points = new Uint16Array(bytes(body.points)), corners = new Uint16Array(bytes(body.corners));
      body.array = gl.createVertexArray(); gl.bindVertexArray(body.array);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer()); gl.bufferData(gl.ARRAY_BUFFER, points, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place); gl.vertexAttribPointer(place, 3, gl.UNSIGNED_SHORT, false, 0, 0);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer()); gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
      body.count = corners.length; body.shown = true;
      const label = document.createElement("label"), box = document.createElement("input"), swatch = document.createElement("i");
      box.type = "checkbox"; box.checked = true; box.name = body.name; box.onchange = () => { body.shown = box.checked; draw(); };
      swatch.style.background = `rgb(${body.color.map(v => Math.round(255 * v)).join()})`;
      label.append(box, swatch, body.name.replaceAll("_", " ")); side.append(label);
    }
    const middle = model.low.map((v, i) => (v + model.high[i]) / 2), size = Math.hypot(...model.low.map((v, i) => model.high[i] - v));
    let turn = -0.9, tip = 0.5, zoom = 1, held = null;
    function draw() {
      const scale = Math.min(devicePixelRatio, 2);
      canvas.width = canvas.clientWidth * scale; canvas.height = canvas.clientHeight * scale;
      gl.viewport(0, 0, canvas.width, canvas.height); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      const far = apart.value / 100, w = canvas.height / canvas.width, k = 1.7 * zoom / size / (1 + 0.7 * far) / Math.max(1, w);
      const c = Math.cos(turn), s = Math.sin(turn), ct = Math.cos(tip), st = Math.sin(tip);
      const rows = [[c, s, 0], [-s * st, c * st, ct], [s * ct, -c * ct, st]];
      const grow = [k * w, k, k], m = new Float32Array(16); m[15] = 1;
      rows.forEach((row, r) => { row.forEach((v, col) => { m[4 * col + r] = v * grow[r]; m[12 + r] -= v * grow[r] * middle[col]; }); });
      gl.uniformMatrix4fv(at("view"), false, m); gl.uniform2f(at("aspect"), 1 / w, 1);
      for (const body of model.bodies) if (body.shown) {
        gl.uniform3fv(at("color"), body.color); gl.uniform3fv(at("shift"), body.apart.map(v => v * far));
        gl.bindVertexArray(body.array); gl.drawElements(gl.TRIANGLES, body.count, gl.UNSIGNED_SHORT, 0);
      }
    }
    function turnBy(x, y) { turn += x; tip = Math.max(-1.57, Math.min(1.57, tip + y)); draw(); }
    canvas.onpointerdown = e => { held = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); };
    canvas.onpointerup = canvas.onpointercancel = () => { held = null; };
    canvas.onpointermove = e => { if (held) { turnBy((held[0] - e.clientX) / 150, (e.clientY - held[1]) / 150); held = [e.clientX, e.clientY]; } };
    const zoomed = by => { zoom = Math.min(20, Math.max(0.5, zoom * by)); draw(); };
    canvas.addEventListener("wheel", e => {
      if (document.activeElement !== canvas) return;  // the page scrolls until somebody clicks here
      e.preventDefault(); zoomed(Math.exp(-e.deltaY / 800));
    }, {passive: false});
    const keys = {ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1]};
    canvas.onkeydown = e => {
      if (keys[e.key]) { e.preventDefault(); turnBy(...keys[e.key]); }
      if (e.key === "+" || e.key === "-") zoomed(e.key === "+" ? 1.1 : 1 / 1.1);
    };
    apart.oninput = draw; addEventListener("resize", draw); draw();
    root.dataset.ready = "yes";
  }
  const seen = new IntersectionObserver(entries => {
    for (const entry of entries) if (entry.isIntersecting) { seen.unobserve(entry.target); load(entry.target); }
  }, {rootMargin: "200px"});
  document.querySelectorAll(".wedge-view:not([data-watched])").forEach(root => { root.dataset.watched = "yes"; root.replaceChildren(); seen.observe(root); });
})();
