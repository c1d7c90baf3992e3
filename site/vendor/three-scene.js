// What the website takes of three.js. Bundle again with `make three-scene` (needs npm and a network).
export {
  BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, Color, ConeGeometry, CylinderGeometry, DirectionalLight,
  DynamicDrawUsage, Group, HemisphereLight, InstancedMesh, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial,
  PerspectiveCamera, PlaneGeometry, Scene, SphereGeometry, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
