// Away from the page: normals of vertices, then the tree in which rays find triangles.

import { BufferAttribute, BufferGeometry } from "three";
import { MeshBVH } from "three-mesh-bvh";
import { vertexNormals } from "./normals";

export interface Order {
  positions: Float32Array<ArrayBuffer>;
  triangles: Uint32Array<ArrayBuffer>;
}

self.onmessage = ({ data }: MessageEvent<Order>) => {
  const normals = vertexNormals(data.positions, data.triangles);
  self.postMessage({ normals }, { transfer: [normals.buffer] });
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(data.positions, 3));
  geometry.setIndex(new BufferAttribute(data.triangles, 1));
  const tree = new MeshBVH(geometry, { indirect: true });
  const { roots, indirectBuffer } = MeshBVH.serialize(tree, { cloneBuffers: false });
  self.postMessage({ tree: { version: 1, roots, index: null, indirectBuffer } });
};
