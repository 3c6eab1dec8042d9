// Starts the worker for a mesh; the mesh can be seen and turned meanwhile.

import { BufferAttribute, BufferGeometry } from "three";
import { MeshBVH, type SerializedBVH } from "three-mesh-bvh";
import type { Mesh } from "./mesh";
import { packAll } from "./normals";
import PrepareWorker from "./prepare-worker?worker";

interface Listener {
  normals(packed: Uint32Array): void;
  tree(tree: MeshBVH): void;
}

type News = { normals: Uint32Array } | { tree: SerializedBVH };

/** Prepare what a mesh needs; returns what stops it. Points need no tree. */
export function prepare(mesh: Mesh, listener: Listener): () => void {
  const { positions, triangles, normals } = mesh;
  if (normals) listener.normals(packAll(normals));
  if (!triangles) return () => undefined;
  const worker = new PrepareWorker();
  worker.onmessage = ({ data }: MessageEvent<News>) => {
    if ("normals" in data) {
      listener.normals(data.normals);
      return;
    }
    worker.terminate();
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(positions, 3));
    geometry.setIndex(new BufferAttribute(triangles, 1));
    listener.tree(MeshBVH.deserialize(data.tree, geometry, { setIndex: false }));
  };
  const order = { positions: positions.slice(), triangles: triangles.slice() };
  worker.postMessage(order, [order.positions.buffer, order.triangles.buffer]);
  return () => worker.terminate();
}
