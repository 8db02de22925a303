// SPDX-License-Identifier: GPL-3.0-or-later
/// Numbers, units and names as text.

export const count = (n: number) => Math.round(n).toLocaleString('en');
export const readable = (bytes: number) =>
    bytes < 1e6 ? `${Math.max(1, Math.round(bytes / 1e3))} KB` : `${(bytes / 1e6).toFixed(1)} MB`;
export const rounded = (n: number) => n.toFixed(Math.abs(n) < 10 ? 2 : Math.abs(n) < 1000 ? 1 : 0);
export const metres = (n: number) => Math.abs(n) < 10_000 ? `${rounded(n)} m` : `${(n / 1000).toFixed(2)} km`;
/// Formats square metres.
export const squareMetres = (n: number) => n < 1e4 ? `${rounded(n)} m²` : n < 1e6 ? `${rounded(n / 1e4)} ha` : `${rounded(n / 1e6)} km²`;

/// Short names of units.
export const UNITS: Record<string, string> = {metre: 'm', foot: 'ft', 'US survey foot': 'ft'};

/// The standard classes of ASPRS LAS 1.4.
export const CLASSES = ['never classified', 'unclassified', 'ground', 'low vegetation', 'medium vegetation', 'high vegetation',
                        'building', 'low point', 'model key', 'water', 'rail', 'road', 'overlap', 'wire guard', 'wire conductor',
                        'transmission tower', 'wire connector', 'bridge deck', 'high noise', 'overhead structure', 'ignored ground', 'snow',
                        'temporal exclusion'];
