// What the scripts of this folder share.
import { createRequire } from 'node:module';
import { existsSync } from 'node:fs';
import { fileURLToPath } from 'node:url';

export const root = fileURLToPath(new URL('../../', import.meta.url));
/// Loads an npm package of web/.
export const require = createRequire(new URL('../../web/package.json', import.meta.url));

/// Ends the script as a test that ctest counts as skipped; as one that failed where FILIGREE_NO_SKIPS is set.
export function skip(reason) {
    console.log(`skipped: ${reason}`);
    process.exit(process.env.FILIGREE_NO_SKIPS ? 1 : 77);
}

/// Ends the script as a test that failed.
export function fail(reason) {
    console.error(reason);
    process.exit(1);
}

/// The first of some programs' places that is there, or undefined.
export function find_program(...places) {
    return places.find((place) => existsSync(place));
}
