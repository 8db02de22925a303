// SPDX-License-Identifier: GPL-3.0-or-later
/// Eye-dome lighting: darkens points next to nearer ones, so that points without normals show their shape.
/// C. Boucheny, "Visualisation scientifique de grands volumes de données" (2009), chapter 3.

/// Compiles and links a program. Throws with the driver's message.
export function link(gl: WebGL2RenderingContext, vertex: string, fragment: string): WebGLProgram {
  const program = gl.createProgram()!;
  for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]] as const) {
    const shader = gl.createShader(type)!;
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
    throw new Error(`The graphics driver rejects the shaders: ${gl.getProgramInfoLog(program)}`);
  }
  return program;
}

const VERTEX = `#version 300 es
void main() {
  // A triangle over the whole picture.
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
uniform highp sampler2D depths;
uniform sampler2D colours;
uniform vec2 range;    // near, far
uniform int radius;    // pixels
out vec4 colour;
float distanceAt(ivec2 at) {
  float depth = texelFetch(depths, clamp(at, ivec2(0), textureSize(depths, 0) - 1), 0).r;
  return log2(range.x * range.y / (range.y - depth * (range.y - range.x)));
}
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  gl_FragDepth = texelFetch(depths, at, 0).r;
  colour = texelFetch(colours, at, 0);
  if (gl_FragDepth >= 1.0) return;
  float here = distanceAt(at), farther = 0.0;
  for (int i = 0; i < 8; ++i) {
    float turn = radians(45.0) * float(i);
    farther += max(0.0, here - distanceAt(at + ivec2(round(float(radius) * vec2(cos(turn), sin(turn))))));
  }
  colour.rgb *= max(0.25, exp(-25.0 * farther / 8.0));
}`;

export class DepthShading {
  private program: WebGLProgram|null = null;  ///< made on first use
  private frame: WebGLFramebuffer|null = null;
  private textures: WebGLTexture[] = [];
  private size = [0, 0];
  private ratio = 1;

  constructor(private readonly gl: WebGL2RenderingContext) {}

  /// Everything drawn until end() is shaded. Width and height are those of the picture.
  begin(width: number, height: number): void {
    const gl = this.gl;
    this.ratio = width / (gl.canvas as HTMLCanvasElement).clientWidth;
    this.program ??= link(gl, VERTEX, FRAGMENT);
    this.frame ??= gl.createFramebuffer()!;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    if (this.size[0] === width && this.size[1] === height) return;
    this.size = [width, height];
    for (const texture of this.textures) gl.deleteTexture(texture);
    this.textures = [[gl.COLOR_ATTACHMENT0, gl.RGBA8], [gl.DEPTH_ATTACHMENT, gl.DEPTH_COMPONENT24]].map(([attachment, format]) => {
      const texture = gl.createTexture()!;
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, texture, 0);
      return texture;
    });
  }
  /// Draws the shaded picture. `near` and `far` are the planes of the projection.
  end(near: number, far: number): void {
    const gl = this.gl, program = this.program!;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.useProgram(program);
    this.textures.forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(gl.getUniformLocation(program, unit === 0 ? 'colours' : 'depths'), unit);
    });
    gl.uniform2f(gl.getUniformLocation(program, 'range'), near, far);
    gl.uniform1i(gl.getUniformLocation(program, 'radius'), Math.max(1, Math.round(1.4 * this.ratio)));
    gl.bindVertexArray(null);
    gl.depthFunc(gl.ALWAYS);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.depthFunc(gl.LESS);
    // The textures must not be bound while they are drawn to.
    gl.bindTexture(gl.TEXTURE_2D, null);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, null);
  }
}
