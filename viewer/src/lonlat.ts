// SPDX-License-Identifier: GPL-3.0-or-later
/// Longitudes and latitudes of positions in a CRS. The page knows geographic CRSs in degrees, UTM and Web Mercator.

import {inDegrees, type Manifest} from './store';

const DEGREE = Math.PI / 180, RADIUS = 6378137, FLATTENING = 1 / 298.257223563;  // WGS 84; GRS 80 differs by 0.1 mm

export interface LonLat {
  to(place: number[]): [number, number];    ///< from the CRS to longitude and latitude in degrees
  from(lonLat: number[]): [number, number];
}

/// Returns the conversion for the CRS of a store; null if the page does not know it.
export function lonLat(manifest: Manifest): LonLat|null {
  if (inDegrees(manifest)) return {to: ([x, y]) => [x, y], from: ([x, y]) => [x, y]};
  const {epsg} = manifest.crs;
  if (epsg === 3857) return WEB_MERCATOR;
  // Zones of WGS 84 north and south, of ETRS89, and of NAD83.
  for (const [first, last, zone, north] of [[32601, 32660, 1, 0], [32701, 32760, 1, 1e7], [25828, 25838, 28, 0], [26901, 26923, 1, 0]]) {
    if (epsg >= first && epsg <= last) return utm(6 * (epsg - first + zone) - 183, north);
  }
  return null;
}

const WEB_MERCATOR: LonLat = {
  to: ([x, y]) => [x / RADIUS / DEGREE, Math.atan(Math.sinh(y / RADIUS)) / DEGREE],
  from: ([lon, lat]) => [lon * DEGREE * RADIUS, Math.asinh(Math.tan(lat * DEGREE)) * RADIUS]
};

/// The transverse Mercator projection of a zone by Krüger's series: C. F. F. Karney, "Transverse Mercator with an accuracy of a
/// few nanometers", doi:10.1007/s00190-011-0445-3, equations 7 to 12, 35 and 36. Four terms are exact to a micrometre here.
function utm(meridian: number, falseNorthing: number): LonLat {
  const n = FLATTENING / (2 - FLATTENING), e = Math.sqrt(FLATTENING * (2 - FLATTENING));
  const scale = 0.9996 * RADIUS / (1 + n) * (1 + n ** 2 / 4 + n ** 4 / 64);
  const forward = [
    n / 2 - 2 * n ** 2 / 3 + 5 * n ** 3 / 16 + 41 * n ** 4 / 180, 13 * n ** 2 / 48 - 3 * n ** 3 / 5 + 557 * n ** 4 / 1440,
    61 * n ** 3 / 240 - 103 * n ** 4 / 140, 49561 * n ** 4 / 161280
  ];
  const back = [
    n / 2 - 2 * n ** 2 / 3 + 37 * n ** 3 / 96 - n ** 4 / 360, n ** 2 / 48 + n ** 3 / 15 - 437 * n ** 4 / 1440,
    17 * n ** 3 / 480 - 37 * n ** 4 / 840, 4397 * n ** 4 / 161280
  ];
  // The tangent of the conformal latitude.
  const conformal = (t: number) => {
    const s = Math.sinh(e * Math.atanh(e * t / Math.hypot(1, t)));
    return t * Math.hypot(1, s) - s * Math.hypot(1, t);
  };
  return {
    from([lon, lat]) {
      const t = conformal(Math.tan(lat * DEGREE)), l = (lon - meridian) * DEGREE;
      const xi0 = Math.atan2(t, Math.cos(l)), eta0 = Math.asinh(Math.sin(l) / Math.hypot(t, Math.cos(l)));
      let xi = xi0, eta = eta0;
      forward.forEach((a, i) => {
        const j = 2 * (i + 1);
        xi += a * Math.sin(j * xi0) * Math.cosh(j * eta0);
        eta += a * Math.cos(j * xi0) * Math.sinh(j * eta0);
      });
      return [500_000 + scale * eta, falseNorthing + scale * xi];
    },
    to([x, y]) {
      const xi = (y - falseNorthing) / scale, eta = (x - 500_000) / scale;
      let xi0 = xi, eta0 = eta;
      back.forEach((b, i) => {
        const j = 2 * (i + 1);
        xi0 -= b * Math.sin(j * xi) * Math.cosh(j * eta);
        eta0 -= b * Math.cos(j * xi) * Math.sinh(j * eta);
      });
      const wanted = Math.sin(xi0) / Math.hypot(Math.sinh(eta0), Math.cos(xi0));
      let t = wanted;
      for (let step = 0; step < 4; ++step) {
        const c = conformal(t);
        t += (wanted - c) / Math.hypot(1, c) * (1 + (1 - e * e) * t * t) / ((1 - e * e) * Math.hypot(1, t));
      }
      return [meridian + Math.atan2(Math.sinh(eta0), Math.cos(xi0)) / DEGREE, Math.atan(t) / DEGREE];
    }
  };
}
