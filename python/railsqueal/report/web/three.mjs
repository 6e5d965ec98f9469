// What the viewer takes of three.js. `three.min.js` is this file with all that it needs:
//   npm install three@0.187.0 esbuild
//   npx esbuild three.mjs --bundle --minify --format=iife --global-name=THREE --legal-comments=eof
// --outfile=three.min.js
export {
    BufferAttribute, BufferGeometry, DataTexture, DoubleSide, LinearFilter, Mesh, PerspectiveCamera, Scene,
    ShaderMaterial, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
