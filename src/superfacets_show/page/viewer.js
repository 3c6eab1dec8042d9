(function(){var e={uint8:Uint8Array,uint16:Uint16Array,uint32:Uint32Array,int32:Int32Array,float32:Float32Array},t=[Uint8Array,Uint8Array,Uint16Array,Uint16Array,Uint32Array];function n(n,a,o){let s={};for(let c of o){let o=c.shape.reduce((e,t)=>e*t,1),l=a+c.offset,u=e[c.dtype];if(c.coding===`plain`){s[c.name]=new u(n,l,o);continue}let d=new t[u.BYTES_PER_ELEMENT](o),f=c.coding===`newest`?o:c.shape[0];r(d,new Uint8Array(n,l),f,c.coding===`difference`),c.coding===`newest`&&i(d),s[c.name]=new u(d.buffer)}return s}function r(e,t,n,r){let i=e.length,a=n?i/n:0;for(let o=0;o<a;o++){let s=0;for(let c=0;c<n;c++){let l=o*n+c,u=0;for(let n=0;n<e.BYTES_PER_ELEMENT;n++)u|=t[n*i+l]<<8*n;s=r?s+u|0:u,e[c*a+o]=s}}}function i(e){let t=0;for(let n=0;n<e.length;n++){let r=e[n];e[n]=t-r,r===0&&t++}}function a(e){let{fromBase64:t}=Uint8Array;if(t)return t.call(Uint8Array,e);let n=atob(e),r=new Uint8Array(n.length);for(let e=0;e<r.length;e++)r[e]=n.charCodeAt(e);return r}function o(e){let t=document.getElementById(e);if(!t)throw Error(`the page has no element with id "${e}"`);return t}function s(e,t={},...n){let r=document.createElement(e);for(let[e,n]of Object.entries(t))r.setAttribute(e,n);return r.append(...n),r}var c=(e,t)=>o(e).addEventListener(`click`,t),l=(e,t,n=`${t}s`)=>`${e.toLocaleString(`en`)} ${e===1?t:n}`,u=e=>e>=.995&&e<1-1e-9?`> 99 %`:`${(100*e).toFixed(+(e<.1))} %`,d=30,f=15,p=4;function m(e,t){let{left:n,top:r}=e.getBoundingClientRect();return{x:t.clientX-n,y:t.clientY-r}}function h(e,t,n){n.preventDefault();let{x:r,y:i}=m(e,n),{clientWidth:a,clientHeight:o}=e,s=n.deltaY*(n.deltaMode?d:1),c=[(r-a/2)/o,(i-o/2)/o];t.zoomBy(Math.exp(-s*.0015),c[0],c[1])}function ee(e,t,{x:n,y:r}){let{left:i,top:a,right:o,bottom:s}=t.getBoundingClientRect();e.style.left=`${Math.min(i+n+f,o-e.offsetWidth-p)}px`,e.style.top=`${Math.min(a+r+f,s-e.offsetHeight-p)}px`}function g(e,t,n,r,i,a){t.bind();let o=new Uint32Array(e.read(n,r,i,a).buffer);for(let e=0;e<o.length;e++)--o[e];return o}var _=4294967295,te=({values:e,low:t,step:n},r)=>[0,1,2].map(i=>t[i]+n[i]*e[3*r+i]),v=()=>({low:[1/0,1/0,1/0],high:[-1/0,-1/0,-1/0]});function ne({values:e,low:t,step:n}){let r=v();for(let i=0;i<e.length;i++){let a=t[i%3]+n[i%3]*e[i];r.low[i%3]=Math.min(r.low[i%3],a),r.high[i%3]=Math.max(r.high[i%3],a)}return r}function re(e,t){return{facts:e,positions:{values:t.positions,low:e.low,step:e.step},triangles:t.triangles??null,sources:t.sources??null,normals:t.normals??null}}var y=Math.PI/24,ie=class{panel;canvas;pressed=new Map;pointer=null;constructor(e){this.panel=e;let{canvas:t,camera:n}=e.drawing;this.canvas=t,t.addEventListener(`contextmenu`,e=>e.preventDefault()),t.addEventListener(`pointerdown`,e=>this.down(e)),t.addEventListener(`pointermove`,e=>this.moved(e)),t.addEventListener(`pointerup`,e=>this.pressed.delete(e.pointerId)),t.addEventListener(`pointercancel`,e=>this.pressed.delete(e.pointerId)),t.addEventListener(`pointerleave`,()=>e.tell(_)),t.addEventListener(`wheel`,r=>{h(t,n,r),e.tell(_)},{passive:!1}),t.addEventListener(`dblclick`,()=>n.home()),t.addEventListener(`keydown`,e=>this.key(e))}down(e){this.canvas.setPointerCapture(e.pointerId),this.pressed.set(e.pointerId,e),this.panel.tell(_)}moved(e){let t=this.pressed.get(e.pointerId);t?(this.drag(t,e),this.pressed.set(e.pointerId,e)):this.pressed.size||this.hoverSoon(m(this.canvas,e))}hoverSoon(e){this.pointer||requestAnimationFrame(()=>{this.pointer&&this.panel.tellAt(this.pointer),this.pointer=null}),this.pointer=e}drag(e,t){let{camera:n}=this.panel.drawing,r=this.canvas.clientHeight,[i,a]=[(t.clientX-e.clientX)/r,(t.clientY-e.clientY)/r],o=[...this.pressed.values()].find(e=>e.pointerId!==t.pointerId);if(o){let r=e=>Math.hypot(e.clientX-o.clientX,e.clientY-o.clientY)||1;n.zoomBy(r(t)/r(e)),n.pan(i/2,a/2)}else t.buttons!==1||t.shiftKey||t.ctrlKey?n.pan(i,a):n.orbit(i*Math.PI,a*Math.PI)}key(e){let{panel:t}=this,{camera:n,borders:r}=t.drawing,i=(t,r)=>{e.shiftKey?n.pan(-t*.05,-r*.05):n.orbit(-t*y,-r*y)},a={ArrowLeft:()=>i(-1,0),ArrowRight:()=>i(1,0),ArrowUp:()=>i(0,-1),ArrowDown:()=>i(0,1),"+":()=>n.zoomBy(1.2),"=":()=>n.zoomBy(1.2),"-":()=>n.zoomBy(1/1.2),0:()=>n.home(),"[":()=>t.setLevel(t.level-1),"]":()=>t.setLevel(t.level+1),i:()=>t.seeInside(!t.drawing.hidesBacks),x:()=>t.nextSection(`x`),y:()=>t.nextSection(`y`),z:()=>t.nextSection(`z`),b:()=>t.setBorders(!r),c:()=>t.nextColoring(),t:()=>t.blend.toggle(),Enter:()=>t.tellMiddle()}[e.key];!a||e.ctrlKey||e.altKey||e.metaKey||(e.preventDefault(),t.tell(_),a())}},b=2048,x={none:`this browser has no WebGL 2`,broken:e=>`a shader program cannot be built: ${e}`,tooLarge:`the mesh is too large for this graphics card`},ae=class{isKept;messages;gl;isFirstProvoking;nUnits=0;noBuffers=null;held=[];constructor(e,t,n=x){this.isKept=t,this.messages=n;let r=e.getContext(`webgl2`,{antialias:!1,powerPreference:`high-performance`,preserveDrawingBuffer:t});if(!r)throw Error(n.none);this.gl=r,this.isFirstProvoking=this.begin()}begin(){let{gl:e}=this;e.enable(e.DEPTH_TEST),e.disable(e.DITHER),e.clearColor(0,0,0,0),e.pixelStorei(e.UNPACK_ALIGNMENT,1),this.noBuffers=e.createVertexArray();let t=e.getExtension(`WEBGL_provoking_vertex`);return t?.provokingVertexWEBGL(t.FIRST_VERTEX_CONVENTION_WEBGL),t!==null}hold(e){this.held.push(e),e.make()}restore(){this.begin();for(let e of this.held)e.make()}nextUnit(){return this.nUnits++}texture(e){let{gl:t}=this,n=t.createTexture();t.activeTexture(t.TEXTURE0+e),t.bindTexture(t.TEXTURE_2D,n);for(let e of[t.TEXTURE_MIN_FILTER,t.TEXTURE_MAG_FILTER])t.texParameteri(t.TEXTURE_2D,e,t.NEAREST);return n}drawNumbers(e){this.gl.bindVertexArray(this.noBuffers),this.gl.drawArrays(this.gl.TRIANGLES,0,e)}read(e,t,n,r){let{gl:i}=this,a=new Uint8Array(4*n*r);return i.readPixels(e,t,n,r,i.RGBA,i.UNSIGNED_BYTE,a),a}},S=class{gpu;vertex;fragment;program;setters=new Map;constructor(e,t,n){this.gpu=e,this.vertex=t,this.fragment=n,e.hold(this)}make(){let{gl:e}=this.gpu,t=this.program=e.createProgram(),n=[this.shader(e.VERTEX_SHADER,this.vertex),this.shader(e.FRAGMENT_SHADER,this.fragment)];if(e.bindAttribLocation(t,0,`vertex`),e.linkProgram(t),!e.getProgramParameter(t,e.LINK_STATUS)&&!e.isContextLost()){let r=[...n.map(t=>e.getShaderInfoLog(t)),e.getProgramInfoLog(t)];throw Error(this.gpu.messages.broken(r.filter(Boolean).join(` `)))}let r=e.getProgramParameter(t,e.ACTIVE_UNIFORMS);for(let n=0;n<r;n++){let{name:r,type:i}=e.getActiveUniform(t,n);this.setters.set(r,this.setter(i,e.getUniformLocation(t,r)))}}shader(e,t){let{gl:n}=this.gpu,r=n.createShader(e);return n.shaderSource(r,t),n.compileShader(r),n.attachShader(this.program,r),r}setter(e,t){let{gl:n}=this.gpu;return{[n.FLOAT]:e=>n.uniform1f(t,e),[n.FLOAT_VEC2]:e=>n.uniform2fv(t,e),[n.FLOAT_VEC3]:e=>n.uniform3fv(t,e),[n.FLOAT_MAT3]:e=>n.uniformMatrix3fv(t,!1,e),[n.FLOAT_MAT4]:e=>n.uniformMatrix4fv(t,!1,e),[n.INT]:e=>n.uniform1i(t,e),[n.BOOL]:e=>n.uniform1i(t,Number(e)),[n.UNSIGNED_INT]:e=>n.uniform1ui(t,e)}[e]??(({unit:e})=>n.uniform1i(t,e))}use(e){this.gpu.gl.useProgram(this.program);for(let[t,n]of Object.entries(e))this.setters.get(t)?.(n)}},C=class{gpu;unit;bytes=0;texels=new Uint8Array;format=`r32`;first=1/0;last=-1;constructor(e){this.gpu=e,this.unit=e.nextUnit(),e.hold(this)}make(){this.gpu.texture(this.unit),this.texels.length&&this.sendAll(this.texels)}get layout(){let{gl:e}=this.gpu;return{r32:[e.R32UI,e.RED_INTEGER,e.UNSIGNED_INT,1,Uint32Array],rgba8:[e.RGBA8,e.RGBA,e.UNSIGNED_BYTE,4,Uint8Array],rgba8ui:[e.RGBA8UI,e.RGBA_INTEGER,e.UNSIGNED_BYTE,4,Uint8Array],rgba16:[e.RGBA16UI,e.RGBA_INTEGER,e.UNSIGNED_SHORT,4,Uint16Array],rgba32:[e.RGBA32UI,e.RGBA_INTEGER,e.UNSIGNED_INT,4,Uint32Array]}[this.format]}fill(e,t){this.format=e;let[,,,n,r]=this.layout,i=Math.max(1,Math.ceil(t.length/n/b));if(i>this.gpu.gl.getParameter(this.gpu.gl.MAX_TEXTURE_SIZE))throw Error(this.gpu.messages.tooLarge);let a=new r(i*b*n);return a.set(t),this.gpu.isKept&&(this.texels=a),this.sendAll(a),this.bytes=a.byteLength}sendAll(e){let{gl:t}=this.gpu,[n,r,i,a]=this.layout,o=e.length/a/b;t.activeTexture(t.TEXTURE0+this.unit),t.texImage2D(t.TEXTURE_2D,0,n,b,o,0,r,i,e),this.first=1/0,this.last=-1}touch(e){let t=Math.floor(e/b);this.first=Math.min(this.first,t),this.last=Math.max(this.last,t)}send(){if(this.last<0)return;let{gl:e}=this.gpu,[,t,n,r]=this.layout;e.activeTexture(e.TEXTURE0+this.unit),e.texSubImage2D(e.TEXTURE_2D,0,0,this.first,b,this.last-this.first+1,t,n,this.texels,this.first*b*r),this.first=1/0,this.last=-1}};function w(e){let t=new Uint8Array(4*e.length/3).fill(255);for(let n=0;n<e.length;n++)t[n+(n/3|0)]=e[n];return t}var oe=class{gpu;unit;bytes=0;image=null;constructor(e){this.gpu=e,this.unit=e.nextUnit(),e.hold(this)}make(){let{gl:e}=this.gpu;this.gpu.texture(this.unit),this.image?this.fill(this.image):e.texImage2D(e.TEXTURE_2D,0,e.RGBA8,1,1,0,e.RGBA,e.UNSIGNED_BYTE,null)}fill(e){let{gl:t}=this.gpu;this.image=this.gpu.isKept?e:null,this.bytes=16*e.width*e.height/3,t.activeTexture(t.TEXTURE0+this.unit),t.texImage2D(t.TEXTURE_2D,0,t.RGBA8,t.RGBA,t.UNSIGNED_BYTE,e),t.generateMipmap(t.TEXTURE_2D),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MIN_FILTER,t.NEAREST_MIPMAP_NEAREST)}},T=class{gpu;colors;depth;width=0;height=0;target;constructor(e,t){this.gpu=e,this.colors=Array.from({length:t},()=>({unit:e.nextUnit()})),this.depth={unit:e.nextUnit()},e.hold(this)}make(){let{gl:e}=this.gpu;this.width=this.height=0,this.target=e.createFramebuffer(),e.bindFramebuffer(e.FRAMEBUFFER,this.target);let t=(t,{unit:n})=>e.framebufferTexture2D(e.FRAMEBUFFER,t,e.TEXTURE_2D,this.gpu.texture(n),0);this.colors.forEach((n,r)=>t(e.COLOR_ATTACHMENT0+r,n)),t(e.DEPTH_ATTACHMENT,this.depth),e.drawBuffers(this.colors.map((t,n)=>e.COLOR_ATTACHMENT0+n))}resize(e,t){let{gl:n}=this.gpu,r=({unit:r},i,a,o)=>{n.activeTexture(n.TEXTURE0+r),n.texImage2D(n.TEXTURE_2D,0,i,e,t,0,a,o,null)};for(let e of this.colors)r(e,n.RGBA8,n.RGBA,n.UNSIGNED_BYTE);r(this.depth,n.DEPTH_COMPONENT24,n.DEPTH_COMPONENT,n.UNSIGNED_INT),Object.assign(this,{width:e,height:t})}begin(e,t){let{gl:n}=this.gpu;(this.width!==e||this.height!==t)&&this.resize(e,t),this.bind(),n.viewport(0,0,e,t),n.clear(n.COLOR_BUFFER_BIT|n.DEPTH_BUFFER_BIT)}copy(e){let{gl:t}=this.gpu;this.begin(e.width,e.height),e.bind(),t.activeTexture(t.TEXTURE0+this.colors[0].unit),t.copyTexSubImage2D(t.TEXTURE_2D,0,0,0,0,0,e.width,e.height),this.bind()}bind(){this.gpu.gl.bindFramebuffer(this.gpu.gl.FRAMEBUFFER,this.target)}},se=`
uniform bool has_texture;
uniform usampler2D texture_corners;  // one texel per triangle: three vertex indices and the tile index
uniform usampler2D texture_pairs;  // two texels per triangle: u and v of its three corners, as the bits of floats
uniform usampler2D texture_tiles;  // three texels per tile: rectangle, wrap modes, color factors
uniform sampler2D texture_image;
const float LEVELS = 5.0;  // highest mipmap level at which adjacent images of the atlas do not blend
int along(int i, int size, uint wrap) {
  if (wrap == 1u) return clamp(i, 0, size - 1);
  int period = wrap == 0u ? size : 2 * size;
  int rest = ((i % period) + period) % period;
  return rest < size ? rest : period - 1 - rest;
}
vec3 smoothed(uvec4 box, uvec4 wraps, vec2 uv, int level) {
  ivec2 size = max(ivec2(box.zw >> level), 1);
  vec2 texel = vec2(uv.x, 1.0 - uv.y) * vec2(size) - 0.5;
  ivec2 corner = ivec2(floor(texel));
  vec2 fraction = texel - floor(texel);
  vec3 rows[2];
  for (int y = 0; y < 2; y++) {
    vec3 pixels[2];
    for (int x = 0; x < 2; x++) {
      ivec2 inside = ivec2(along(corner.x + x, size.x, wraps.x), along(corner.y + y, size.y, wraps.y));
      pixels[x] = texelFetch(texture_image, ivec2(box.xy >> level) + inside, level).rgb;
    }
    rows[y] = mix(pixels[0], pixels[1], fraction.x);
  }
  return mix(rows[0], rows[1], fraction.y);
}
vec3 textureColor(uint piece, vec3 at) {
  vec3 right = dFdx(at);
  vec3 up = dFdy(at);
  uvec4 corners = texelFetch(texture_corners, place(piece), 0);
  uvec4 box = texelFetch(texture_tiles, place(3u * corners.w), 0);
  uvec4 wraps = texelFetch(texture_tiles, place(3u * corners.w + 1u), 0);
  vec3 tint = vec3(texelFetch(texture_tiles, place(3u * corners.w + 2u), 0).rgb) / 255.0;
  if (box.z == 0u) return tint;
  vec3 a = seen(texelFetch(vertices, place(corners.x), 0));
  vec3 b = seen(texelFetch(vertices, place(corners.y), 0)) - a;
  vec3 c = seen(texelFetch(vertices, place(corners.z), 0)) - a;
  vec3 across = cross(b, c);
  float scale = max(dot(across, across), 1e-30);
  // Maps a vector v in the plane of the triangle to the coefficients (s, t) in v = s * b + t * c.
  mat3x2 coefficients = transpose(mat2x3(cross(c, across), cross(across, b))) / scale;
  uvec4 first = texelFetch(texture_pairs, place(2u * piece), 0);
  uvec4 second = texelFetch(texture_pairs, place(2u * piece + 1u), 0);
  vec2 origin = uintBitsToFloat(first.xy);
  mat2 sides = mat2(uintBitsToFloat(first.zw) - origin, uintBitsToFloat(second.xy) - origin);
  vec2 uv = origin + sides * (coefficients * (at - a));
  vec2 size = vec2(box.zw);
  float texels_per_pixel = max(length(size * (sides * (coefficients * right))), length(size * (sides * (coefficients * up))));
  float level = clamp(log2(max(texels_per_pixel, 1.0)), 0.0, min(LEVELS, floor(log2(min(size.x, size.y)))));
  int whole = int(level);
  vec3 paint = smoothed(box, wraps, uv, whole);
  if (level > float(whole)) paint = mix(paint, smoothed(box, wraps, uv, whole + 1), level - float(whole));
  return tint * paint;
}
`,ce=class{corners;pairs;tiles;image;isShown=!1;constructor(e){[this.corners,this.pairs,this.tiles]=Array.from({length:3},()=>new C(e));for(let e of[this.corners,this.pairs,this.tiles])e.fill(`rgba32`,[0]);this.image=new oe(e)}get bytes(){return this.corners.bytes+this.pairs.bytes+this.tiles.bytes+this.image.bytes}show({triangles:e},t,n,r){let[i,a]=[n.tile_of,n.pairs],o=i.length,s=new Uint32Array(4*o),c=new Float32Array(8*o);for(let n=0;n<o;n++){s.set(e.subarray(3*n,3*n+3),4*n),s[4*n+3]=i[n];for(let e=0;e<6;e++)c[8*n+e]=t.low[e%2]+t.step[e%2]*a[6*n+e]}let l=t.tiles.flatMap(e=>[...e.slice(0,4),e[4],e[5],0,0,...e.slice(6),0]);this.corners.fill(`rgba32`,s),this.pairs.fill(`rgba32`,new Uint32Array(c.buffer)),this.tiles.fill(`rgba32`,l),this.image.fill(r),this.isShown=!0}get values(){let{corners:e,pairs:t,tiles:n,image:r,isShown:i}=this;return{has_texture:i,texture_corners:e,texture_pairs:t,texture_tiles:n,texture_image:r}}},le=`${se}
uniform bool has_own_colors;
uniform sampler2D own_colors;  // color of each vertex or point, if are_of_vertices; otherwise of each cell
uniform bool are_of_vertices;
flat in uint triangle;
in vec3 tint;
vec3 ownColor() {
  if (has_texture) return textureColor(triangle, at);
  return are_of_vertices ? tint : texelFetch(own_colors, place(cell), 0).rgb;
}
`,ue=`
const mat3 LMS = mat3(0.4122, 0.2119, 0.0883, 0.5363, 0.6807, 0.2817, 0.0514, 0.1074, 0.6300);
const mat3 LAB = mat3(0.2105, 1.9780, 0.0259, 0.7936, -2.4286, 0.7828, -0.0041, 0.4506, -0.8087);
const mat3 FROM_LMS = inverse(LMS);
const mat3 FROM_LAB = inverse(LAB);
vec3 oklab(vec3 color) { return LAB * pow(LMS * pow(color, vec3(2.2)), vec3(1.0 / 3.0)); }
vec3 linearOf(vec3 lab) { return FROM_LMS * pow(max(FROM_LAB * lab, 0.0), vec3(3.0)); }
vec3 tinted(vec3 color, vec3 own, float part) {
  if (part >= 1.0) return own;
  vec3 lab = oklab(color);
  lab.x = mix(lab.x, oklab(own).x, part);
  float chroma = 1.0;  // fraction of the chroma; bisection finds the largest that sRGB has
  for (float width = 0.5; width > 0.01; width *= 0.5) {
    vec3 found = linearOf(vec3(lab.x, chroma * lab.yz));
    bool fits = all(greaterThan(found, vec3(-0.002))) && all(lessThan(found, vec3(1.002)));
    chroma = fits ? min(1.0, chroma + width) : chroma - width;
  }
  return pow(clamp(linearOf(vec3(lab.x, chroma * lab.yz)), 0.0, 1.0), vec3(1.0 / 2.2));
}
`,E=({texture:e},t)=>!!(e||t.vertex_colors||t.cell_colors),de=class{isShown=!1;areOfVertices=!1;wanted=null;texture;colors;constructor(e){this.texture=new ce(e),this.colors=new C(e),this.clear()}get bytes(){return this.texture.bytes+this.colors.bytes}clear(){this.wanted=null,this.isShown=this.areOfVertices=this.texture.isShown=!1,this.colors.fill(`rgba8`,[0])}async show(e,t){let{vertex_colors:n,cell_colors:r}=t,{texture:i}=e.facts;if(this.wanted=e,i){let n={...t},r=new Blob([t.atlas],{type:`image/jpeg`}),a=await createImageBitmap(r,{colorSpaceConversion:`none`});if(this.wanted!==e)return;this.texture.show(e,i,n,a)}else(n||r)&&(this.areOfVertices=n!==void 0,this.colors.fill(`rgba8`,w(n??r)));this.isShown=E(e.facts,t)}get values(){let{texture:e,colors:t,isShown:n,areOfVertices:r}=this;return{...e.values,has_own_colors:n,own_colors:t,are_of_vertices:r}}},fe=class{row;slider;changed;opacity=0;constructor(e,t,n){this.row=e,this.slider=t,this.changed=n,t.addEventListener(`input`,()=>this.set(Number(t.value)))}set(e){this.opacity=e,this.slider.value=String(e),this.changed()}begin(e,t){this.row.hidden=!e,this.set(e?t:0)}toggle(){return this.row.hidden||this.set(this.opacity===1?0:1),!this.row.hidden}},D=65535,pe=class{facts;arrays;levels;truth;colorings=[];last=null;constructor(e,t){this.facts=e,this.arrays=t,this.levels=e.levels.map((e,t)=>this.labeling(e,`level_${t}`)),this.truth=e.truth&&this.labeling(e.truth,`truth`),this.levels.length&&this.colorings.push({kind:`level`,name:`Regions`}),this.truth&&this.colorings.push({kind:`truth`,name:`Ground truth`}),e.features.forEach((e,n)=>{let r=t[`feature_${n}`];this.colorings.push({kind:`feature`,name:e.name,feature:e,values:r})}),this.colorings.length||this.colorings.push({kind:`plain`,name:`Plain`})}labeling(e,t){let n=e=>this.arrays[`${t}_${e}`];return{...e,name:t,colors:n(`colors`),counts:n(`counts`),sizes:n(`sizes`)}}get base(){return this.arrays.level_0_labels}labelsOf({name:e}){let t=this.arrays[`${e}_labels`];if(t)return t;if(this.last?.name===e)return this.last.labels;let n=this.arrays[`${e}_parents`],r=this.base.map(e=>e===4294967295?_:n[e]);return this.last={name:e,labels:r},r}groupsOf(e,t){let n=Uint32Array.from(t,e=>e===D?_:e>>8);return e.of===`cell`?n:this.base.map(e=>e===4294967295?_:n[e])}valueOf(e,t,n){let r=e.of===`cell`?n:this.base[n],i=r===4294967295?D:t[r];return i===D?null:e.low+(e.high-e.low)*i/65534}},O=(e,t)=>e[0]*t[0]+e[1]*t[1]+e[2]*t[2],k=e=>Math.sqrt(O(e,e)),A=(e,t,n=1)=>[e[0]+n*t[0],e[1]+n*t[1],e[2]+n*t[2]],j=(e,t)=>A(e,t,-1),M=(e,t)=>[t*e[0],t*e[1],t*e[2]],me=(e,t)=>[e[1]*t[2]-e[2]*t[1],e[2]*t[0]-e[0]*t[2],e[0]*t[1]-e[1]*t[0]];function he(e){if(!e.length)return null;let t=M(e.reduce((e,t)=>A(e,t)),1/e.length);return{middle:t,radius:e.reduce((e,n)=>Math.max(e,k(j(n,t))),0)}}var ge=e=>M(e,1/(k(e)||1)),N=Math.tan(10*Math.PI/180),P=Math.tan(30*Math.PI/180),F=.94,I=.001,L=50,_e=.02,ve=1.2,ye=[.35,.8],be=300,R=.001,z=(e,t)=>Math.abs(Math.sin((e-t)/2))<R/2,xe=class{changed;target=[0,0,0];size=1;zoom=1;slope=N;aspect=1;azimuth=0;elevation=0;facts=null;axes=[[1,0,0],[0,1,0],[0,0,1]];positions=null;fitted=0;flight=null;earlier=[];constructor(e){this.changed=e}show(e,t){this.facts=e,this.axes=e.axes,this.positions=t,this.earlier.length=0,this.flight=null,this.begin()}resize(e,t){this.aspect=e/t}get pose(){let{azimuth:e,elevation:t,distance:n,target:r}=this.flight??this;return{azimuth:e,elevation:t,distance:n*this.slope,target:r}}jump(){this.earlier.push(this.pose),this.flight=null}back(){let{pose:{azimuth:e,elevation:t,distance:n,target:r}}=this,i=i=>z(i.azimuth,e)&&z(i.elevation,t)&&Math.abs(i.distance-n)<R*n&&k(j(i.target,r))<R*n,a=this.earlier.pop();for(;a&&i(a);)a=this.earlier.pop();return a&&this.animate({...a,distance:a.distance/this.slope}),a!==void 0}home(){this.facts&&(this.jump(),this.begin())}begin(){let{azimuth:e,elevation:t,zoom:n}=this.facts.view;this.azimuth=e*Math.PI/180,this.elevation=t*Math.PI/180,this.zoom=n,this.target=[0,0,0],this.fitted=0,this.changed()}turnUp(){let[,e,t]=this.axes,n=this.directions()[2],r=this.axes.flatMap(e=>[e,M(e,-1)]).reduce((e,t)=>O(t,n)>O(e,n)?t:e);this.setUp(r,Math.abs(O(r,e))>.5?t:M(e,-1)),this.begin()}setUp(e,t){this.axes=[me(e,t),e,t],this.flight=null,this.earlier.length=0,this.fitted=0}turnTo(e,t){this.jump(),[this.azimuth,this.elevation]=[e,t],this.changed()}isAt(e,t){return z(this.azimuth,e)&&z(this.elevation,t)}get place(){let{axes:[,e,t],facts:n}=this;return[this.azimuth,this.elevation,this.distance,...this.target,...e===n?.axes[1]?[]:[...e,...t]]}set place(e){let[[t,n,r],i,a,o]=[0,3,6,9].map(t=>e.slice(t,t+3));o.length===3&&this.setUp(a,o);let{distance:s}=this;this.target=i,this.setDistance(r),this.turnTo(t,n),this.earlier.length=0}get distance(){return!this.fitted&&this.positions&&this.fit(this.positions),this.fitted/this.zoom}fit({values:e,low:t,step:n}){let r=this.directions(),[i,a,o]=r.map(e=>e.map((e,t)=>e*n[t])),s=r.map(e=>O(e,t)),c=1/(this.slope*F),l=1e-6,u=1e-12;for(let t=0;t<e.length;t+=3){let[n,r,d]=[e[t],e[t+1],e[t+2]],f=i[0]*n+i[1]*r+i[2]*d+s[0],p=a[0]*n+a[1]*r+a[2]*d+s[1],m=o[0]*n+o[1]*r+o[2]*d+s[2],h=m+c*Math.max(Math.abs(p),Math.abs(f)/this.aspect);h>l&&(l=h),u=Math.max(u,f*f+p*p+m*m)}this.fitted=l,this.size=Math.sqrt(u)}directions({azimuth:e,elevation:t}=this){let[n,r,i]=this.axes,[a,o]=[Math.sin(e),Math.cos(e)],[s,c]=[Math.sin(t),Math.cos(t)],l=(e,t,a)=>[0,1,2].map(o=>e*n[o]+t*r[o]+a*i[o]);return[l(o,0,-a),l(-a*s,c,-o*s),l(a*c,s,o*c)]}get eye(){return this.eyeOf(this)}eyeOf(e){let{distance:t,target:n}=e,{aspect:r}=this,i=1.1*this.size+k(n),a=t+i,o=Math.max(t-i,_e*t),s=(a+o)/(o-a),c=2*a*o/(o-a),[l,u,d]=this.directions(e);return{rotation:[0,1,2].flatMap(e=>[l[e],u[e],d[e]]),target:n,distance_:t,projection:[1/(this.slope*r),0,0,0,0,1/this.slope,0,0,0,0,s,-1,0,0,c,0],near_far:[o,a]}}get isWide(){return this.slope===P}get closeness(){return N/this.slope}distanceFor(e){return this.closeness*Math.max(12*e,.3*this.size)}widen(e){this.flight=null;let t=this.distance*this.slope;this.slope=e?P:N,this.fitted=0,this.setDistance(t/this.slope),this.changed()}walk(e,t,n){this.flight=null;let r=[e,t,-n];this.target=this.directions().reduce((e,t,n)=>A(e,t,r[n]*this.size),this.target),this.changed()}orbit(e,t){this.flight=null;let{distance:n}=this,r=A(this.target,this.directions()[2],n);this.azimuth-=e,this.elevation=Math.max(-Math.PI/2,Math.min(Math.PI/2,this.elevation+t)),this.isWide&&(this.target=A(r,this.directions()[2],-n)),this.changed()}pan(e,t){this.flight=null;let[n,r]=this.directions(),i=2*this.slope*this.distance;this.target=A(A(this.target,n,-e*i),r,t*i),this.changed()}zoomBy(e,t=0,n=0){this.pan(-t,-n),this.setDistance(this.distance/e),this.pan(t,n)}setDistance(e){let{distance:t,zoom:n,size:r}=this;this.zoom=n*t/Math.max(I*r,Math.min(L*r,e))}pixelsOf(e){return e/(2*this.slope)}distanceTo(e){return k(j(e,A(this.target,this.directions()[2],this.distance)))}get depths(){let e=this.directions()[2],t=this.distance+O(this.target,e);return n=>t-n[0]*e[0]-n[1]*e[1]-n[2]*e[2]}projected(e){let[t,n,r]=this.directions(),i=j(e,this.target.map(Math.fround)),a=this.distance-O(i,r),o=2*this.slope*a;return[.5+O(i,t)/(o*this.aspect),.5-O(i,n)/o,a]}placeOf(e){let[t,n,r]=this.projected(e);return r>0&&t>=0&&t<=1&&n>=0&&n<=1?[t,n]:null}fly(e,t,n){let[r,i]=this.anglesToward(t);this.flyTo({azimuth:r,elevation:i,distance:n,target:e})}posesAround(e,t,n){let[r,i]=this.anglesToward(t);return Array.from({length:8},(t,a)=>({azimuth:r+a*Math.PI/4,elevation:a?ye[a%2]:i,distance:n,target:e}))}flyTo(e){this.jump(),this.animate(e)}animate({azimuth:e,elevation:t,distance:n,target:r}){let i=[this.azimuth,this.elevation,this.distance,...this.target],a=Math.atan2(Math.sin(e-i[0]),Math.cos(e-i[0])),o=[i[0]+a,t,n,...r],s=this.flight={azimuth:o[0],elevation:t,distance:n,target:r},c=matchMedia(`(prefers-reduced-motion: reduce)`).matches,l=performance.now(),u=e=>{if(s!==this.flight)return;let t=c?1:Math.min(1,Math.max(0,(e-l)/be)),n=t*t*(3-2*t),[r,a,d,f,p,m]=i.map((e,t)=>e+(o[t]-e)*n);[this.azimuth,this.elevation,this.target]=[r,a,[f,p,m]],this.setDistance(d),this.changed(),t<1?requestAnimationFrame(u):this.flight=null};u(l)}anglesToward(e){if(k(e)===0)return[this.azimuth,this.elevation];let[t,n,r]=this.axes,i=ge(e),a=Math.asin(Math.max(-1,Math.min(1,O(i,n))));return[Math.abs(a)>1.4?this.azimuth:Math.atan2(O(i,t),O(i,r)),Math.max(-1.2,Math.min(ve,a))]}},Se=65278,Ce=.9;function we(e,t,n){let r=Math.abs(e)+Math.abs(t)+Math.abs(n)||1,i=e/r,a=t/r;return n<0&&([i,a]=[(1-Math.abs(a))*(i<0?-1:1),(1-Math.abs(i))*(a<0?-1:1)]),Math.round((i+1)*127)|Math.round((a+1)*127)<<8||Se}function Te(e,t){let n=new Float32Array(e.values.length),r=new Float32Array(3);for(let i=0;i<t.length;i+=3){B(e,t,i,r);for(let e=0;e<9;e++)n[3*t[i+(e/3|0)]+e%3]+=r[e%3]}let i=new Uint16Array(n.length/3);for(let e=0;e<i.length;e++){let t=3*e,r=Math.sqrt(n[t]**2+n[t+1]**2+n[t+2]**2)||1;for(let e=0;e<3;e++)n[t+e]/=r;i[e]=we(n[t],n[t+1],n[t+2])}for(let a=0;a<t.length;a+=3){let o=Ce*B(e,t,a,r);for(let e=0;e<3;e++){let s=3*t[a+e];r[0]*n[s]+r[1]*n[s+1]+r[2]*n[s+2]<o&&(i[s/3]=0)}}return i}function B({values:e,step:t},n,r,i){let[a,o,s]=[3*n[r],3*n[r+1],3*n[r+2]],c=(e[o]-e[a])*t[0],l=(e[o+1]-e[a+1])*t[1],u=(e[o+2]-e[a+2])*t[2],d=(e[s]-e[a])*t[0],f=(e[s+1]-e[a+1])*t[1],p=(e[s+2]-e[a+2])*t[2];return i[0]=l*p-u*f,i[1]=u*d-c*p,i[2]=c*f-l*d,Math.sqrt(i[0]*i[0]+i[1]*i[1]+i[2]*i[2])}var V=`#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
const uint NONE = ${_}u;
ivec2 place(uint i) { return ivec2(int(i % ${b}u), int(i / ${b}u)); }
`,H=`
uniform usampler2D vertices;  // one texel per vertex: x, y, z and the encoded normal
uniform bool has_floats;  // whether x, y, z are the bits of floats, not integers; a coordinate is low + step_ * value
uniform vec3 low;
uniform vec3 step_;
uniform mat3 rotation;  // rotation from mesh to eye coordinates
uniform vec3 target;
uniform float distance_;
uniform mat4 projection;
vec3 seen(uvec4 texel) {
  vec3 steps = has_floats ? uintBitsToFloat(texel.xyz) : vec3(texel.xyz);
  return rotation * (low + step_ * steps - target) - vec3(0.0, 0.0, distance_);
}
`,U=`
vec3 unpacked(uint bits) {
  vec2 xy = vec2(bits & 255u, bits >> 8) / 127.0 - 1.0;
  vec3 v = vec3(xy, 1.0 - abs(xy.x) - abs(xy.y));
  if (v.z < 0.0) v.xy = (1.0 - abs(v.yx)) * vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0);
  return normalize(v);
}
// Normal in eye coordinates of a texel of the table of vertices; (0, 0, 0) for NO_NORMAL.
vec3 normalOf(uvec4 texel) { return texel.w == 0u ? vec3(0.0) : rotation * unpacked(texel.w); }
`,W=`${V}${H}${U}
in uvec2 vertex;  // x: index of the vertex; y: triangle that has this vertex as first corner
uniform usampler2D sources;  // cell of each triangle, if has_sources; otherwise triangle i is cell i
uniform bool has_sources;
uniform bool is_cloud;
uniform float point_size;  // diameter of a point at distance 1, in pixels
uniform sampler2D own_colors;  // color of each vertex or point, if are_of_vertices
uniform bool are_of_vertices;
flat out uint cell;
flat out uint triangle;
out vec3 at;
out vec3 normal;  // normal in eye coordinates; (0, 0, 0) for NO_NORMAL
out float smoothness;  // 1 for a vertex with a normal, 0 for a vertex on a crease
out vec3 tint;
void main() {
  uint piece = is_cloud ? vertex.x : vertex.y;
  triangle = piece;
  cell = has_sources ? texelFetch(sources, place(piece), 0).r : piece;
  uvec4 texel = texelFetch(vertices, place(vertex.x), 0);
  at = seen(texel);
  normal = normalOf(texel);
  smoothness = texel.w == 0u ? 0.0 : 1.0;
  tint = are_of_vertices ? texelFetch(own_colors, place(vertex.x), 0).rgb : vec3(0.0);
  gl_Position = projection * vec4(at, 1.0);
  gl_PointSize = max(1.0, point_size / -at.z);
}`,G=`
uniform bool is_cloud;
flat in uint cell;
in vec3 at;
in vec3 normal;
in float smoothness;
float light(vec3 lamp) {
  if (is_cloud && smoothness == 0.0) return 0.9;
  vec3 toward = normalize(-at);
  vec3 flat_ = is_cloud ? normalize(normal) : normalize(cross(dFdx(at), dFdy(at)));
  flat_ = dot(flat_, toward) < 0.0 ? -flat_ : flat_;
  vec3 bent = dot(flat_, normal) < 0.0 ? -normal : normal;
  vec3 shading = normalize(bent + max(0.0, 1.0 - smoothness) * flat_);
  float key = max(0.0, dot(shading, normalize(lamp)));
  return 0.42 + 0.48 * key + 0.16 * max(0.0, dot(shading, toward));
}
`,K=`
uniform bool is_clipped;
uniform vec3 clip_low;
uniform vec3 clip_high;
bool isOutside(vec3 at) {
  vec3 here = transpose(rotation) * (at + vec3(0.0, 0.0, distance_)) + target;
  return is_clipped && (any(lessThan(here, clip_low)) || any(greaterThan(here, clip_high)));
}
`,q=`${K}
uniform bool hides_backs;
bool isLeftOut() {
  return isOutside(at) || (hides_backs && (is_cloud ? dot(normal, at) > 0.0 : !gl_FrontFacing));
}
`,J={vertex:U,fragment:K},Ee=`
vec4 codeOf(uint cell) {
  uint number = cell + 1u;
  return vec4(uvec4(number, number >> 8, number >> 16, number >> 24) & 255u) / 255.0;
}
`,De=class{gpu;vertices;bufferBytes=0;nCorners=0;sources;hasSources=!1;hasFloats=!1;isCloud=!1;facts;shape=null;state=null;buffers=[];constructor(e){this.gpu=e,this.vertices=new C(e),this.sources=new C(e),e.hold(this)}make(){this.shape&&this.show(this.shape)}show(e){let{facts:t,positions:n,triangles:r,sources:i,normals:a}=e;this.shape=this.gpu.isKept?e:null,this.facts=t,this.isCloud=r===null,this.hasSources=i!==null,this.hasFloats=n.values instanceof Float32Array;let o=r?Te(n,r):a;this.vertices.fill(this.hasFloats?`rgba32`:`rgba16`,Ae(n,o)),this.sources.fill(`r32`,i??new Uint32Array(1)),this.sendCorners(r,n.values.length/3)}sendCorners(e,t){let{gl:n,isFirstProvoking:r}=this.gpu,{vertices:i,corners:a}=e?ke(e,t):Oe(t);for(let e=0;!r&&e<a.length;e+=3)a.set([a[e+1],a[e+2],a[e]],e);this.nCorners=e?a.length:t,this.bufferBytes=i.byteLength+a.byteLength,n.deleteVertexArray(this.state);for(let e of this.buffers.splice(0))n.deleteBuffer(e);this.state=n.createVertexArray(),n.bindVertexArray(this.state),this.sendBuffer(n.ARRAY_BUFFER,i),n.enableVertexAttribArray(0),n.vertexAttribIPointer(0,2,n.UNSIGNED_INT,0,0),this.sendBuffer(n.ELEMENT_ARRAY_BUFFER,a)}sendBuffer(e,t){let{gl:n}=this.gpu,r=n.createBuffer();this.buffers.push(r),n.bindBuffer(e,r),n.bufferData(e,t,n.STATIC_DRAW)}placing(e){let{facts:t,vertices:n,hasFloats:r}=this;return{...e,vertices:n,has_floats:r,low:t.low,step_:t.step}}draw(e,t,n,r){let{gl:i}=this.gpu;e.use({...this.placing(t),sources:this.sources,has_sources:this.hasSources,is_cloud:this.isCloud,point_size:n*this.facts.point_size,...r}),i.bindVertexArray(this.state),this.isCloud?i.drawArrays(i.POINTS,0,this.nCorners):i.drawElements(i.TRIANGLES,this.nCorners,i.UNSIGNED_INT,0)}get bytes(){return this.bufferBytes+this.vertices.bytes+this.sources.bytes}};function Oe(e){let t=new Uint32Array(2*e);for(let n=0;n<e;n++)t[2*n]=n;return{vertices:t,corners:new Uint32Array}}function ke(e,t){let n=e.length/3,r=new Uint32Array(e.length),i=new Uint32Array(t+n).fill(_),a=new Uint32Array(n),o=0;for(let s=0;s<n;s++){let n=0;for(;n<3&&i[e[3*s+n]]!==4294967295;)n++;let c=n===3;c&&(n=0);for(let t=0;t<3;t++)r[3*s+t]=e[3*s+(n+t)%3];c&&(a[o]=r[3*s],r[3*s]=t+o++),i[r[3*s]]=s}let s=new Uint32Array(2*(t+o));for(let e=0;e<t+o;e++)s[2*e]=e<t?e:a[e-t],s[2*e+1]=i[e];return{vertices:s,corners:r}}function Ae({values:e},t){let n=e instanceof Float32Array,r=n?new Uint32Array(e.buffer,e.byteOffset,e.length):e,i=new(n?Uint32Array:Uint16Array)(4*e.length/3);for(let e=0;e<t.length;e++){for(let t=0;t<3;t++)i[4*e+t]=r[3*e+t];i[4*e+3]=t[e]}return i}var je=`${V}${G}${H}${q}${le}${ue}
uniform float blend;  // opacity of the mesh's own colors or texture, 0 to 1
uniform usampler2D groups;  // color group of each cell, or NONE
uniform sampler2D colors;  // color of each group
uniform usampler2D regions;  // region of each cell, or NONE
uniform vec3 missing;  // color of cells without a group
uniform uint marked;  // region under the pointer, or NONE
out vec4 color;
void main() {
  uint group = texelFetch(groups, place(cell), 0).r;
  vec3 base = group == NONE ? missing : texelFetch(colors, place(group), 0).rgb;
  vec3 own = has_own_colors ? ownColor() : base;  // must be computed before any discard, because derivatives need neighboring pixels
  if (isLeftOut()) discard;
  if (blend > 0.0) base = group == NONE ? mix(base, own, blend) : tinted(base, own, blend);
  if (marked != NONE && texelFetch(regions, place(cell), 0).r == marked) base = mix(base, vec3(1.0), 0.45);
  color = vec4(min(base * light(vec3(0.4, 0.55, 0.75)), 1.0), 1.0);
}`,Me=`${V}${G}${H}${q}${Ee}
out vec4 found;
void main() {
  if (isLeftOut()) discard;
  found = codeOf(cell);
}`,Ne=`${V}${H}${J.vertex}
uniform usampler2D edges;  // one texel per edge: two vertices and two adjacent cells
uniform usampler2D regions;
uniform vec2 frame;  // width and height of the canvas in pixels
uniform float line_width;  // width of borders in pixels
uniform bool hides_backs;
out vec3 at;
void main() {
  uvec4 edge = texelFetch(edges, place(uint(gl_VertexID / 6)), 0);
  int corner = gl_VertexID % 6;  // the rectangle consists of the triangles 0 1 2 and 2 1 3
  corner = corner < 3 ? corner : corner == 3 ? 2 : corner == 4 ? 1 : 3;
  uint left = texelFetch(regions, place(edge.z), 0).r;
  uint right = texelFetch(regions, place(edge.w), 0).r;
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  at = vec3(0.0);
  if (left == right) return;
  uvec4 first = texelFetch(vertices, place(edge.x), 0);
  uvec4 second = texelFetch(vertices, place(edge.y), 0);
  vec3 a = seen(first);
  vec3 b = seen(second);
  if (hides_backs && max(dot(normalOf(first), a), dot(normalOf(second), b)) > 0.0) return;
  float pixel = 2.0 / (projection[1][1] * frame.y);  // size of a pixel at distance 1
  a *= 1.0 - 1.2 * line_width * pixel;
  b *= 1.0 - 1.2 * line_width * pixel;
  vec4 from = projection * vec4(a, 1.0);
  vec4 to = projection * vec4(b, 1.0);
  if (from.w <= 0.0 || to.w <= 0.0) return;
  vec2 along = (to.xy / to.w - from.xy / from.w) * frame;
  along = length(along) > 0.0 ? normalize(along) : vec2(1.0, 0.0);
  float end = (corner & 1) == 0 ? -1.0 : 1.0;
  float side = (corner & 2) == 0 ? -1.0 : 1.0;
  vec4 place_ = end < 0.0 ? from : to;
  at = end < 0.0 ? a : b;
  vec2 shift = line_width * (0.35 * end * along + side * vec2(-along.y, along.x));
  gl_Position = place_ + vec4(shift / frame * place_.w, 0.0, 0.0);
}`,Pe=`${V}${H}${J.fragment}
in vec3 at;
out vec4 color;
void main() {
  if (isOutside(at)) discard;
  color = vec4(0.11, 0.11, 0.12, 1.0);
}`,Fe=4,Ie=40,Le=.5,Y=240,Re=150,ze=class{canvas;gpu;camera=new xe(()=>this.move());stats={frames:0,picks:0,calls:0,sentBytes:0,scriptMs:0};marked=_;borders=!0;hidesBacks=!1;clip=null;opacity=()=>0;ownColors;nEdges;lineWidth=()=>1;isCoarse=!1;frameMs;surface;shade;cellsProgram;border;groups;regions;colors;edges;samples;cellsFrame;cellsView=``;missing=[0,0,0];waiting=0;resting=0;constructor(e,t,n){this.canvas=e;let r=this.gpu=new ae(e,!1);this.surface=new De(r),this.shade=new S(r,W,je),this.cellsProgram=new S(r,W,Me),this.border=new S(r,Ne,Pe),[this.groups,this.regions,this.colors,this.edges]=Array.from({length:4},()=>new C(r)),this.samples=new Be(r.gl),this.cellsFrame=new T(r,1),this.ownColors=new de(r),this.surface.show(t),this.nEdges=(n?.length??0)/4,this.edges.fill(`rgba32`,n??[]),this.camera.show(t.facts,t.positions)}get gpuBytes(){return[this.surface,this.ownColors,this.groups,this.regions,this.colors,this.edges].reduce((e,{bytes:t})=>e+t,0)}get nCorners(){return this.surface.nCorners}async setOwnColors(e,t){await this.ownColors.show(e,t),this.request()}setRegions(e){this.stats.sentBytes+=this.regions.fill(`r32`,e),this.request()}setGroups(e,t,n){this.stats.sentBytes+=this.groups.fill(`r32`,e)+this.colors.fill(`rgba8`,w(t)),this.missing=n,this.request()}resize(){let{canvas:e}=this,t=(window.devicePixelRatio||1)*(this.isCoarse?Le:1),n=Math.max(1,Math.round(e.clientWidth*t)),r=Math.max(1,Math.round(e.clientHeight*t));return(e.width!==n||e.height!==r)&&Object.assign(e,{width:n,height:r}),this.camera.resize(n,r),{width:n,height:r,ratio:t}}request(){this.waiting||=requestAnimationFrame(e=>{this.waiting=0,this.draw(),requestAnimationFrame(t=>this.noteFrame(t-e))})}noteFrame(e){this.isCoarse||(this.frameMs=this.frameMs===void 0?0:(this.frameMs+e)/2)}move(){this.isCoarse||=(this.frameMs??0)>Ie,clearTimeout(this.resting),this.resting=window.setTimeout(()=>this.rest(),Re),this.request()}rest(){this.isCoarse&&(this.isCoarse=!1,this.request())}draw(){let{gl:e}=this.gpu,t=performance.now(),n=this.resize();this.isCoarse?e.bindFramebuffer(e.FRAMEBUFFER,null):this.samples.begin(n.width,n.height),e.viewport(0,0,n.width,n.height),e.clear(e.COLOR_BUFFER_BIT|e.DEPTH_BUFFER_BIT),this.drawSurface(this.shade,n.height),this.borders&&this.nEdges&&this.drawBorders(n),this.isCoarse||this.samples.show(),this.stats.frames++,this.stats.scriptMs+=performance.now()-t}get leftOut(){let{clip:e,hidesBacks:t}=this;return{hides_backs:t,is_clipped:e!==null,clip_low:e?.low??[0,0,0],clip_high:e?.high??[0,0,0]}}drawSurface(e,t,n=this.camera.eye){let{camera:r,groups:i,regions:a,colors:o,marked:s}=this;this.stats.calls++,this.surface.draw(e,n,r.pixelsOf(t),{...this.ownColors.values,...this.leftOut,blend:this.opacity(),groups:i,regions:a,colors:o,marked:s,missing:this.missing.map(e=>e/255)})}drawBorders({width:e,height:t,ratio:n}){let{camera:r,edges:i,regions:a}=this,o=r.pixelsOf(t)/r.distance,s=this.lineWidth(o/n,t/n)*n;this.stats.calls++,this.border.use({...this.surface.placing(r.eye),...this.leftOut,edges:i,regions:a,frame:[e,t],line_width:s}),this.gpu.drawNumbers(6*this.nEdges)}drawCells(e){let t=[e.width,e.height,...Object.values({...this.camera.eye,...this.leftOut})].join();t!==this.cellsView&&(this.cellsFrame.begin(e.width,e.height),this.drawSurface(this.cellsProgram,e.height),this.stats.picks++,this.cellsView=t)}bestPose(e,t,n){let r=Math.ceil(Y*this.canvas.height/this.canvas.width);this.cellsView=``;let i=e.map(e=>(this.cellsFrame.begin(Y,r),this.drawSurface(this.cellsProgram,r,this.camera.eyeOf(e)),g(this.gpu,this.cellsFrame,0,0,Y,r).reduce((e,r)=>e+Number(t[r]===n),0)));return e[i.indexOf(Math.max(...i))]}cellAt({x:e,y:t}){this.isCoarse&&(this.isCoarse=!1,this.draw());let n=this.resize();this.drawCells(n);let[r,i]=[Math.floor(e*n.ratio),Math.floor(t*n.ratio)];return g(this.gpu,this.cellsFrame,r,n.height-1-i,1,1)[0]}},Be=class{gl;target;buffers;width=0;height=0;constructor(e){this.gl=e,this.target=e.createFramebuffer(),this.buffers=[e.createRenderbuffer(),e.createRenderbuffer()]}begin(e,t){let{gl:n}=this;if(n.bindFramebuffer(n.FRAMEBUFFER,this.target),this.width===e&&this.height===t)return;Object.assign(this,{width:e,height:t});let r=Math.min(Fe,n.getParameter(n.MAX_SAMPLES)),i=[n.COLOR_ATTACHMENT0,n.DEPTH_ATTACHMENT];[n.RGBA8,n.DEPTH_COMPONENT24].forEach((a,o)=>{n.bindRenderbuffer(n.RENDERBUFFER,this.buffers[o]),n.renderbufferStorageMultisample(n.RENDERBUFFER,r,a,e,t),n.framebufferRenderbuffer(n.FRAMEBUFFER,i[o],n.RENDERBUFFER,this.buffers[o])})}show(){let{gl:e,width:t,height:n}=this;e.bindFramebuffer(e.READ_FRAMEBUFFER,this.target),e.bindFramebuffer(e.DRAW_FRAMEBUFFER,null),e.blitFramebuffer(0,0,t,n,0,0,t,n,e.COLOR_BUFFER_BIT,e.NEAREST),e.bindFramebuffer(e.FRAMEBUFFER,null)}},Ve=class{positions;bounds;vertices;constructor({positions:e,triangles:t,sources:n},r){this.positions=e,this.bounds=ne(e),this.vertices=t&&new Uint32Array(r).fill(4294967295);for(let e=0;t&&e<t.length/3;e++)this.vertices[n?n[e]:e]=t[3*e]}sphereOf(e,t){let n=[];return t.forEach((t,r)=>{let i=this.vertices?this.vertices[r]:r;t===e&&i!==4294967295&&n.push(te(this.positions,i))}),he(n)}section(e,t){if(!e)return null;let[n,r]=[[...this.bounds.low],[...this.bounds.high]],i=`xyz`.indexOf(e[1]),a=r[i]-n[i];return e[0]===`-`?r[i]=n[i]+t*a:n[i]=r[i]-t*a,{low:n,high:r}}},He=40,Ue=[``,`-x`,`+x`,`-y`,`+y`,`-z`,`+z`],We=[205,197,184],X=[150,150,150],Ge=[`triangles`,`edges`,`normals`,`pairs`,`tile_of`,`atlas`,`vertex_colors`,`cell_colors`];function Z(e){let t=Math.abs(e);return t&&(t<1e-4||t>=1e9)?e.toExponential(3):e.toLocaleString(`en`,{maximumSignificantDigits:4})}var Q=(e,t)=>`rgb(${e.subarray(3*t,3*t+3).join()})`,Ke=class{facts;content;drawing;colored;coloring;level=0;list=o(`coloring`);slider=o(`level`);places;section=o(`section`);share=o(`share`);inside=o(`inside`);checkbox=o(`borders`);blend=new fe(o(`texture-row`),o(`texture`),()=>this.drawing.request());tip=o(`tip`);constructor(e,t){this.facts=e;let n=o(`canvas`);this.content=new pe(e,t);let r=re(e,t);this.drawing=new ze(n,r,t.edges),this.colored=this.drawing.setOwnColors(r,t),this.places=new Ve(r,e.n_cells);let i=E(e,t);for(let e of Ge)delete t[e];this.drawing.lineWidth=(e,t)=>this.lineWidth(e,t),this.coloring=this.content.colorings[0],this.fillControls(),this.blend.begin(i,this.coloring.kind===`plain`?1:.5),new ResizeObserver(()=>this.drawing.request()).observe(n),this.show()}get labeling(){return this.coloring.kind===`truth`?this.content.truth:this.content.levels[this.level]??this.content.truth}lineWidth(e,t){let n=this.labeling?.mean_area??0,r=Math.sqrt(4*n/Math.PI)*e;return Math.max(.6,Math.min(Math.max(1,t/450),.02*r))}fillControls(){let{content:e,list:t,slider:n,checkbox:r}=this;e.colorings.forEach(({name:e},n)=>t.add(new Option(e,String(n)))),t.addEventListener(`change`,()=>this.setColoring(Number(t.value))),o(`coloring-row`).hidden=e.colorings.length<2,n.max=String(Math.max(0,e.levels.length-1)),n.addEventListener(`input`,()=>this.setLevel(Number(n.value))),o(`level-row`).hidden=e.levels.length<2,o(`borders-row`).hidden=!this.drawing.nEdges,r.addEventListener(`change`,()=>this.setBorders(r.checked));for(let e of Ue)this.section.add(new Option(e?`${e[1]}, ${e[0]===`-`?`low`:`high`} side`:`none`,e));this.section.addEventListener(`change`,()=>this.setSection(this.section.value)),this.share.addEventListener(`input`,()=>this.setSection(this.section.value)),this.inside.addEventListener(`change`,()=>this.seeInside(this.inside.checked));let i=o(`find`);i.addEventListener(`change`,()=>i.value&&this.find(Number(i.value))),this.drawing.opacity=()=>this.blend.opacity,c(`reset`,()=>this.drawing.camera.home()),c(`theme`,()=>{let{dataset:e}=document.documentElement,t=matchMedia(`(prefers-color-scheme: dark)`).matches;e.theme=(e.theme??(t?`dark`:`light`))===`dark`?`light`:`dark`})}setColoring(e){this.coloring=this.content.colorings[e],this.list.value=String(e),this.show()}nextColoring(){let{colorings:e}=this.content;this.setColoring((e.indexOf(this.coloring)+1)%e.length)}setLevel(e){this.level=Math.max(0,Math.min(this.content.levels.length-1,e)),this.slider.value=String(this.level),this.show()}setBorders(e){this.drawing.borders=this.checkbox.checked=e,this.drawing.request()}setSection(e){this.section.value=e,this.share.hidden=!e,this.drawing.clip=this.places.section(e,Number(this.share.value)),this.drawing.request()}nextSection(e){let{value:t}=this.section;this.setSection(t===`-${e}`?`+${e}`:t===`+${e}`?``:`-${e}`)}seeInside(e){this.drawing.hidesBacks=this.inside.checked=e,this.drawing.request()}find(e){let{labeling:t}=this,n=t?.ids?t.ids.indexOf(e):e;t&&t.counts[n]?this.goTo(n):o(`status`).textContent=`there is no region ${e}`}goTo(e){let{drawing:t,drawing:{camera:n}}=this,r=this.content.labelsOf(this.labeling),i=this.places.sphereOf(e,r),a=this.factsOf(r.indexOf(e)).join(`, `);if(o(`status`).textContent=i?a:`${a} (inside the body)`,!i)return;let s=Math.min(n.distance*n.zoom,n.distanceFor(i.radius));n.flyTo(t.bestPose(n.posesAround(i.middle,i.middle,s),r,e)),t.marked=e}listRegions(e){let t=[...e?.sizes??[]],n=t.reduce((e,t)=>e+t,0),r=[...t.keys()].sort((e,n)=>t[n]-t[e]).slice(0,He).map(r=>{let i=s(`i`);i.style.background=Q(e.colors,r);let a=s(`button`,{type:`button`},i,s(`span`,{},`${e.name===`truth`?`part`:`region`} ${e.ids?.[r]??r}`),u(t[r]/n));return a.addEventListener(`click`,()=>this.goTo(r)),s(`li`,{},a)});o(`list`).replaceChildren(...r),o(`list-row`).hidden=o(`find-row`).hidden=!r.length}show(){let{content:e,coloring:t,labeling:n,drawing:r}=this,i=new Uint32Array(n?0:this.facts.n_cells).fill(_),a=n?e.labelsOf(n):i;if(r.marked=_,r.setRegions(a),t.kind===`feature`){let n=e.groupsOf(t.feature,t.values);r.setGroups(n,e.arrays.scale,X)}else n&&t.kind!==`plain`?r.setGroups(a,n.colors,X):r.setGroups(a,new Uint8Array(3),We);this.describe(),this.tell(_)}describe(){let{coloring:e,labeling:t,content:n,facts:r,slider:i}=this,a=e.kind===`feature`?e.feature:null,{levels:s}=n,c=s.length>1?l(s[this.level].counts.length,`region`):``;if(o(`level-text`).textContent=c,i.setAttribute(`aria-valuetext`,c),i.disabled=e.kind===`truth`,o(`scale`).hidden=!a,a){let e=Array.from({length:18},(e,t)=>Q(n.arrays.scale,15*t));o(`scale-name`).textContent=a.name,o(`scale-low`).textContent=Z(a.low),o(`scale-high`).textContent=Z(a.high),o(`scale-bar`).style.background=`linear-gradient(to right, ${e.join()})`}let u=(a?a.n_missing:t?.n_left_out)??0;o(`gray`).hidden=!u,o(`gray-text`).textContent=a?`${l(u,a.of===`cell`?r.noun:`region`)} without a value`:`${l(u,r.noun)} in no region`,this.listRegions(a?null:t),o(`regions`).hidden=!!a||!t;let d=e.kind===`truth`?`part`:`region`;o(`regions`).querySelectorAll(`i`).forEach((e,n)=>{e.hidden=n>=(t?.counts.length??0),t&&!e.hidden&&(e.style.background=Q(t.colors,n))}),o(`regions-text`).textContent=`${l(t?.counts.length??0,d)}, neighbors in different colors`}factsOf(e){let{labeling:t,content:n,coloring:r,facts:i}=this,a=[],o=t?n.labelsOf(t)[e]:_;if(t?o===4294967295?a.push(`no region`):(a.push(`${t.name===`truth`?`part`:`region`} ${t.ids?t.ids[o]:o}`),a.push(l(t.counts[o],i.noun)),a.push(`${i.measure} ${Z(t.sizes[o])}`)):a.push(`${i.noun} ${e}`),r.kind===`feature`){let t=n.valueOf(r.feature,r.values,e);a.push(`${r.name} ${t===null?`none`:Z(t)}`)}return a}tell(e,t={x:0,y:0}){let{tip:n,labeling:r,drawing:i}=this,a=e===4294967295?[]:this.factsOf(e),o=e!==4294967295&&r?this.content.labelsOf(r)[e]:_;return o!==i.marked&&(i.marked=o,i.request()),n.hidden=e===_,n.textContent=a.join(`
`),n.hidden||ee(n,i.canvas,t),a}tellAt(e){return this.tell(this.drawing.cellAt(e),e)}tellMiddle(){let{clientWidth:e,clientHeight:t}=this.drawing.canvas,n=this.tellAt({x:e/2,y:t/2});o(`status`).textContent=n.join(`, `)||`no ${this.facts.noun} in the middle`}};async function qe(e){let t=new Blob([e]).stream().pipeThrough(new DecompressionStream(`deflate`));return new Response(t).arrayBuffer()}async function Je(){let e=JSON.parse(o(`facts`).textContent),t=o(`payload`),r=await qe(a(t.textContent.trim()));t.remove();let i=new Ke(e,n(r,0,e.arrays));return new ie(i),await i.colored,i}function $(e){o(`failure`).textContent=`The mesh cannot be shown: ${e}.`,o(`failure`).hidden=!1}async function Ye(){let{dataset:e}=document.documentElement;o(`canvas`).addEventListener(`webglcontextlost`,()=>$(`the graphics card stopped responding; reload the page`));try{window.superfacets=await Je(),e.state=`ready`}catch(t){$(t.message),e.state=`failed`}}window.addEventListener(`load`,()=>void Ye())})();