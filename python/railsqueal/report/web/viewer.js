// Modes as moving surfaces: x + a (cos θ re + sin θ im), θ running. `#motion=K&phase=P` shows motion K (from 0) at the
// part P of its period and holds it there; with `&alone` nothing else is on the page.
"use strict";
(function () {
    const figure = document.getElementById("viewer");
    const data = JSON.parse(document.getElementById("viewer-data").textContent);
    const part = (name) => figure.querySelector(`[data-part="${name}"]`);

    function array(text, Kind) {
        const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
        return new Kind(bytes.buffer);
    }

    const vertex = `
        uniform float cosine, sine, amplitude;
        attribute vec3 re, im;
        varying vec3 seen;
        varying float size;
        void main() {
            vec3 moved = cosine * re + sine * im;
            size = length(moved);
            vec4 place = modelViewMatrix * vec4(position + amplitude * moved, 1.0);
            seen = place.xyz;
            gl_Position = projectionMatrix * place;
        }`;
    // The normal of the deformed facet follows from the derivatives of its place on the screen.
    const fragment = `
        uniform sampler2D colours;
        varying vec3 seen;
        varying float size;
        void main() {
            vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
            float light = 0.62 + 0.38 * abs(dot(normal, normalize(vec3(-0.35, 0.55, 0.76))));
            // The first and the last colour are in the middle of the first and the last texel.
            float at = (clamp(size, 0.0, 1.0) * ${data.colours.length - 1}.0 + 0.5) / ${data.colours.length}.0;
            gl_FragColor = vec4(texture2D(colours, vec2(at, 0.5)).rgb * light, 1.0);
        }`;

    let renderer;
    try {
        renderer = new THREE.WebGLRenderer({ canvas: part("canvas"), antialias: true, preserveDrawingBuffer: true });
    } catch (error) {
        part("missing").hidden = false;
        part("stage").hidden = true;
        figure.dataset.state = "no WebGL";
        return;
    }
    renderer.setClearColor(0xffffff);
    // Colours are those of the pictures, as they are.
    renderer.outputColorSpace = "srgb-linear";

    const scene = new THREE.Scene();
    const camera = new THREE.PerspectiveCamera(28, 1, 0.01, 1000);
    camera.up.set(0, 0, 1);
    const controls = new THREE.OrbitControls(camera, part("canvas"));
    const texels = new Uint8Array(data.colours.flatMap((c) => [...c.map((v) => Math.round(255 * v)), 255]));
    const colours = new THREE.DataTexture(texels, data.colours.length, 1);
    colours.minFilter = colours.magFilter = THREE.LinearFilter;
    colours.needsUpdate = true;
    const uniforms = {
        cosine: { value: 1 }, sine: { value: 0 }, amplitude: { value: 0 },
        colours: { value: colours },
    };
    const material = new THREE.ShaderMaterial({
        vertexShader: vertex, fragmentShader: fragment, uniforms, side: THREE.DoubleSide,
    });
    const meshes = data.meshes.map(() => null);
    let shown = null;

    function surface(k) {
        if (!meshes[k]) {
            const given = data.meshes[k];
            const geometry = new THREE.BufferGeometry();
            geometry.setAttribute("position", new THREE.BufferAttribute(array(given.points, Float32Array), 3));
            geometry.setIndex(new THREE.BufferAttribute(array(given.triangles, Uint32Array), 1));
            geometry.computeBoundingSphere();
            meshes[k] = new THREE.Mesh(geometry, material);
            meshes[k].frustumCulled = false;
        }
        return meshes[k];
    }

    function look(mesh, azimuth, elevation) {
        const { center } = mesh.geometry.boundingSphere;
        const [a, e] = [azimuth, elevation].map((angle) => (angle * Math.PI) / 180);
        const towards = new THREE.Vector3(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e));
        const right = new THREE.Vector3(-Math.sin(a), Math.cos(a), 0);
        const up = new THREE.Vector3().crossVectors(towards, right);
        // The nearest place from which every point is seen, with some room for its motion.
        const box = part("stage").getBoundingClientRect();
        const high = Math.tan((camera.fov * Math.PI) / 360) / 1.15;
        const wide = (high * box.width) / box.height;
        const places = mesh.geometry.attributes.position, point = new THREE.Vector3();
        let distance = 0;
        for (let k = 0; k < places.count; k++) {
            point.fromBufferAttribute(places, k).sub(center);
            const near = Math.max(Math.abs(point.dot(right)) / wide, Math.abs(point.dot(up)) / high);
            distance = Math.max(distance, near + point.dot(towards));
        }
        controls.target.copy(center);
        camera.position.set(
            center.x + distance * Math.cos(e) * Math.cos(a),
            center.y + distance * Math.cos(e) * Math.sin(a),
            center.z + distance * Math.sin(e),
        );
        camera.near = 0.01 * distance;
        camera.far = 10 * distance;
        camera.updateProjectionMatrix();
        controls.update();
    }

    const VIEWS = { oblique: [-58, 20], side: [-90, 0], along: [0.001, 0], above: [-90, 89.9] };
    let theta = 0, running = true, visible = true, before = null, motion = 0;

    function show(k) {
        motion = k;
        const given = data.motions[k];
        const mesh = surface(given.mesh);
        const count = mesh.geometry.attributes.position.count;
        const re = array(given.re, Int16Array);
        const im = given.im ? array(given.im, Int16Array) : new Int16Array(3 * count);
        // 32767 is the largest amplitude of the motion.
        mesh.geometry.setAttribute("re", new THREE.BufferAttribute(re, 3, true));
        mesh.geometry.setAttribute("im", new THREE.BufferAttribute(im, 3, true));
        if (shown !== mesh) {
            if (shown) { scene.remove(shown); }
            scene.add(mesh);
            shown = mesh;
            look(mesh, ...VIEWS[part("view").value]);
        }
        part("motion").value = String(k);
        part("title").textContent = given.note;
        figure.dataset.motion = String(k);
        figure.dataset.points = String(count);
    }

    function axes() {
        const right = new THREE.Vector3(), up = new THREE.Vector3(), back = new THREE.Vector3();
        camera.matrixWorld.extractBasis(right, up, back);
        for (const [name, at] of [["x", "x"], ["y", "y"], ["z", "z"]]) {
            const [h, v] = [26 * right[at], -26 * up[at]];
            const line = part(`axis-${name}`), label = part(`label-${name}`);
            line.setAttribute("x2", h);
            line.setAttribute("y2", v);
            label.setAttribute("x", 1.35 * h);
            label.setAttribute("y", 1.35 * v);
        }
    }

    function draw() {
        const box = part("stage").getBoundingClientRect();
        const [wide, high] = [Math.max(1, Math.round(box.width)), Math.max(1, Math.round(box.height))];
        if (renderer.domElement.dataset.size !== `${wide}x${high}`) {
            renderer.domElement.dataset.size = `${wide}x${high}`;
            renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
            renderer.setSize(wide, high, false);
            camera.aspect = wide / high;
            camera.updateProjectionMatrix();
        }
        uniforms.cosine.value = Math.cos(theta);
        uniforms.sine.value = Math.sin(theta);
        const size = data.meshes[data.motions[motion].mesh].size;
        uniforms.amplitude.value = Number(part("amplitude").value) * size;
        controls.update();
        renderer.render(scene, camera);
        axes();
        part("phase").textContent = `${(theta / (2 * Math.PI)).toFixed(2)} of the period`;
        figure.dataset.state = "drawn";
    }

    function step(now) {
        if (running && before !== null) {
            theta = (theta + ((now - before) / 1000) * 2 * Math.PI * Number(part("speed").value)) % (2 * Math.PI);
        }
        before = now;
        if (visible) { draw(); }
        window.requestAnimationFrame(step);
    }

    function hold(stopped) {
        running = !stopped;
        part("play").textContent = running ? "pause" : "play";
    }

    function address() {
        const given = new URLSearchParams(window.location.hash.slice(1));
        const wanted = Number(given.get("motion"));
        document.body.classList.toggle("alone", given.has("alone"));
        if (given.has("motion") && wanted >= 0 && wanted < data.motions.length) {
            show(wanted);
            if (!given.has("alone")) { figure.scrollIntoView(); }
        }
        if (given.has("view") && VIEWS[given.get("view")]) {
            part("view").value = given.get("view");
            look(shown, ...VIEWS[given.get("view")]);
        }
        if (given.has("phase")) {
            theta = 2 * Math.PI * Number(given.get("phase"));
            hold(true);
        }
    }

    part("motion").addEventListener("change", (event) => show(Number(event.target.value)));
    part("play").addEventListener("click", () => hold(running));
    part("view").addEventListener("change", (event) => look(shown, ...VIEWS[event.target.value]));
    window.addEventListener("beforeprint", draw);
    // Out of sight nothing is drawn.
    new IntersectionObserver((entries) => { visible = entries.at(-1).isIntersecting; }).observe(part("stage"));
    window.addEventListener("hashchange", address);
    show(0);
    // Readers who ask for less motion start it themselves.
    hold(window.matchMedia("(prefers-reduced-motion: reduce)").matches);
    address();
    draw();
    window.requestAnimationFrame(step);
})();
