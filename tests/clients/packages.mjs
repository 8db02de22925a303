// SPDX-License-Identifier: GPL-3.0-or-later
// Loads the npm packages that clients_test.sh installed.

import {createRequire} from 'node:module';
import {join} from 'node:path';

export const packages = process.argv[2];
export const load = createRequire(join(packages, 'package.json'));
