// SPDX-License-Identifier: GPL-3.0-or-later
// Functions that run in the page of globe.html, where CesiumJS is available as Cesium. Each is
// self-contained; arguments and results are plain data.

/// Opens a provider of the tiles and returns the extensions that it has.
export async function open(url) {
  Cesium.Ion.defaultAccessToken = '';
  const provider = await Cesium.CesiumTerrainProvider.fromUrl(
      url, {requestVertexNormals: true, requestWaterMask: true});
  window.provider = provider;
  window.providerErrors = [];
  provider.errorEvent.addEventListener(error => window.providerErrors.push(error.message));
  return {
    normals: provider.hasVertexNormals,
    water: provider.hasWaterMask,
    metadata: provider.hasMetadata
  };
}

/// Returns the heights at [longitude, latitude] in degrees, or the error as a string.
export async function sample(places) {
  try {
    const points = places.map(place => Cesium.Cartographic.fromDegrees(...place));
    await Cesium.sampleTerrainMostDetailed(window.provider, points, true);
    return points.map(point => point.height);
  } catch (error) {
    return `sampleTerrainMostDetailed: ${error.message ?? error}`;
  }
}

/// Returns whether the client considers tiles available: true, false or 'unknown'. Tiles are given
/// by zoom, column and row from the north.
export function available(tiles) {
  return tiles.map(({z, x, row}) => window.provider.getTileDataAvailable(x, row, z) ?? 'unknown');
}

/// Returns the extensions of tiles as arrays of numbers, as the client received them.
export async function extensionsOf(tiles) {
  return Promise.all(tiles.map(async ({z, x, row}) => {
    const {_encodedNormals: normals, _waterMask: water} =
        await window.provider.requestTileGeometry(x, row, z);
    return {normals: normals && Array.from(normals), water: water && Array.from(water)};
  }));
}

/// Draws the globe seen towards a place; resolves once its tiles have been loaded for some frames.
export async function draw({target, range, lowest, highest}) {
  const widget = new Cesium.CesiumWidget('globe', {
    terrainProvider: window.provider,
    baseLayer: false,
    skyBox: false,
    skyAtmosphere: false,
    msaaSamples: 1,
    creditContainer: 'credits',
    contextOptions: {webgl: {preserveDrawingBuffer: true}},
  });
  window.widget = widget;
  const {scene} = widget;
  const {globe} = scene;
  scene.fog.enabled = false;
  scene.highDynamicRange = false;
  scene.backgroundColor = Cesium.Color.fromCssColorString('#aac4dd');
  globe.showGroundAtmosphere = false;
  globe.showWaterEffect = false;
  // Red encodes the height, from 0 to 255.
  const ramp = document.createElement('canvas');
  ramp.width = 256;
  ramp.height = 1;
  const paint = ramp.getContext('2d');
  for (let i = 0; i < 256; ++i) {
    paint.fillStyle = `rgb(${i}, ${Math.round(90 + 0.6 * i)}, ${Math.round(70 + 0.7 * i)})`;
    paint.fillRect(i, 0, 1, 1);
  }
  globe.material = Cesium.Material.fromType(
      'ElevationRamp', {image: ramp, minimumHeight: lowest, maximumHeight: highest});
  widget.camera.lookAt(
      Cesium.Cartesian3.fromDegrees(...target),
      new Cesium.HeadingPitchRange(Cesium.Math.toRadians(20), Cesium.Math.toRadians(-35), range));
  let still = 0;
  const start = performance.now();
  return new Promise(resolve => scene.postRender.addEventListener(() => {
    still = globe.tilesLoaded ? still + 1 : 0;
    if (still > 5)
      resolve(true);
    else if (performance.now() - start > 60000)
      resolve(false);
  }));
}

/// Returns what was drawn: the tiles, with the client's vertices for those of the deepest zoom (u
/// and v from 0 to 1, metres), and at sample pixels the height by colour and by ray.
export function look({z, lowest, highest}) {
  const {scene, camera} = window.widget;
  const {globe} = scene;
  const tiles = globe._surface._tilesToRender.map(tile => {
    const drawn = {z: tile.level, x: tile.x, row: tile.y, upsampled: tile.upsampledFromParent};
    if (tile.level !== z || tile.upsampledFromParent) return drawn;
    const {vertices, encoding, vertexCountWithoutSkirts} = tile.data.renderedMesh;
    drawn.vertices = Array.from({length: vertexCountWithoutSkirts}, (_, i) => {
      const place = encoding.decodeTextureCoordinates(vertices, i, new Cesium.Cartesian2());
      return [place.x, place.y, encoding.decodeHeight(vertices, i)];
    });
    return drawn;
  });
  const copy = document.createElement('canvas');
  copy.width = scene.canvas.width;
  copy.height = scene.canvas.height;
  const paint = copy.getContext('2d', {willReadFrequently: true});
  paint.drawImage(scene.canvas, 0, 0);
  const pick = (x, y) => {
    const ray = camera.getPickRay(new Cesium.Cartesian2(x + 0.5, y + 0.5));
    const hit = globe.pick(ray, scene);
    return hit && Cesium.Cartographic.fromCartesian(hit).height;
  };
  const pixels = [];
  for (let x = 60; x < copy.width; x += 85) {
    for (let y = 40; y < copy.height; y += 52) {
      const around = [pick(x, y), pick(x - 1, y), pick(x + 1, y), pick(x, y - 1), pick(x, y + 1)];
      if (around.some(height => height === undefined)) continue;
      const red = paint.getImageData(x, y, 1, 1).data[0];
      pixels.push({
        x,
        y,
        byRay: around[0],
        spread: Math.max(...around) - Math.min(...around),
        byColour: lowest + (highest - lowest) * (red + 0.5) / 256
      });
    }
  }
  return {tiles, pixels};
}

/// Lights the same view from the side, for visual inspection.
export async function light() {
  const {scene} = window.widget;
  scene.globe.enableLighting = true;
  scene.globe.dynamicAtmosphereLighting = false;
  scene.globe.lambertDiffuseMultiplier = 1.2;
  const {directionWC: down, rightWC: right} = scene.camera;
  scene.light = new Cesium.DirectionalLight({
    direction: Cesium.Cartesian3.normalize(
        Cesium.Cartesian3.add(
            Cesium.Cartesian3.multiplyByScalar(right, 1.5, new Cesium.Cartesian3()), down,
            new Cesium.Cartesian3()),
        new Cesium.Cartesian3())
  });
  let frames = 0;
  return new Promise(resolve => scene.postRender.addEventListener(() => ++frames > 4 && resolve()));
}
