#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the pictures of README and the manual, in docs/pictures.

TERRACE=path/to/terrace BUILD=build PYTHONPATH=build/... docs/tools/pictures.py [NAME...]    all, or those with these names

Most are files that the commands of a page write: the page runs as in its test (tests/docs), and its picture is reduced.
Others need further commands in the page's folder. Those of the viewer and of the globe are taken with headless Chromium;
the packages that this needs are installed below BUILD, as for the test of clients. Needs gdal_translate. A picture of
more than 150,000 bytes is refused.
"""

import os
import shutil
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, 'tests', 'docs'))
from pages import Page  # noqa: E402

OUT = os.path.join(ROOT, 'docs', 'pictures')
MOST_BYTES = 150_000
ALPS = os.path.join(ROOT, 'libterrain', 'examples', 'alps.tif')
REGIONS = '''{"regions": [
  {"box": [400600, 5194400, 405600, 5199400], "semi_axes": [2.2, 0.45], "angle": 40},
  {"box": [407000, 5194400, 412000, 5199400], "semi_axes": [2.2, 0.45], "angle": -40},
  {"box": [403300, 5188000, 409300, 5193000], "semi_axes": [2.2, 0.45], "angle": 90}
]}'''

# name: (page whose commands run first, width in pixels, further commands, file to take)
PICTURES = {
    'dem.jpg': ('docs/get-started.md', 900, [], 'dem.png'),
    'focus.jpg': ('docs/get-started.md', 600, [], 'focus.png'),
    'bounded.jpg': ('docs/guides/game-engine.md', 900, [], 'bounded.png'),
    'survey.jpg': ('docs/guides/laser-survey.md', 900, [], 'survey.png'),
    'ground.jpg': ('docs/guides/laser-survey.md', 900, [], 'ground.png'),
    'surface.jpg': ('docs/guides/scan.md', 600, [], 'surface.png'),
    'scan_focus.jpg': ('docs/guides/scan.md', 600, [], 'focus.png'),
    'clusters.jpg': ('docs/guides/clustering.md', 700, [], 'clusters.png'),
    'dendrogram.png': ('docs/guides/clustering.md', None, [], 'tree.png'),
    'pairs.png': ('docs/guides/matching.md', None, [], 'pairs.png'),
    'matching_tree.png': ('docs/guides/matching.md', None, [], 'tree.png'),
    'notebook.png': ('docs/guides/python.md', None, [
        'python3 -c "import terrace; open(\'mesh.png\', \'wb\').write(terrace.open(\'hills.terrace\').bounded_mesh(2)._repr_png_())"'],
        'mesh.png'),
    'metric_regions.jpg': (None, 640, [
        f"cat > regions.json <<'JSON'\n{REGIONS}\nJSON", 'terrace synth dem --size 420x420 -o dem.tif -q',
        'terrace cluster dem.tif -o c.ply --metric elliptical:regions.json --facility-cost 3 --z-weight 0 --bound-iterations 0 -q',
        'terrace render c.ply -o clusters.png --size 640x640 -q'], 'clusters.png'),
    'alps.jpg': (None, None, [
        f'terrace build {ALPS} -o alps.store -q',
        "viewer_picture alps.store '#s=alps&q=2&v=20500,-44500,1000,15,40,20000&c=height' alps.jpg 1000x560"], 'alps.jpg'),
    'viewer.jpg': ('docs/guides/viewer.md', None, [
        "viewer_picture dem.terrace '#s=dem&q=1&v=0,-3000,3000,20,50,22000&c=height' viewer.jpg 900x500"], 'viewer.jpg'),
    'globe.jpg': ('docs/guides/web-globe.md', None, ['globe_picture . globe.jpg 1000x560'], 'globe.jpg'),
}

# Commands that the entries above use.
CHROMIUM = '''
viewer_picture() {{ "{root}/tests/clients/clients_test.sh" "$BUILD" "{root}/tests/viewer/picture.mjs" "$@"; }}
globe_picture() {{ "{root}/tests/clients/clients_test.sh" "$BUILD" "{root}/docs/tools/globe_picture.mjs" "$@"; }}
'''.format(root=ROOT)


def environment(folder):
    programs = os.path.join(folder, '.bin')
    os.mkdir(programs)
    os.symlink(os.path.abspath(os.environ['TERRACE']), os.path.join(programs, 'terrace'))
    os.symlink('/bin/true', os.path.join(programs, 'xdg-open'))
    os.symlink('/usr/bin/python3', os.path.join(programs, 'python3'))
    return {**os.environ, 'PATH': programs + os.pathsep + os.environ['PATH'], 'BUILD': os.path.abspath(os.environ['BUILD']),
            'PYTHONPATH': os.path.abspath(os.environ.get('PYTHONPATH', '.')), 'TERRACE': os.path.abspath(os.environ['TERRACE'])}


def reduce(source, target, width):
    """Writes a JPEG of this width, of the best quality that MOST_BYTES allow."""
    for quality in range(88, 30, -8):
        subprocess.run(['gdal_translate', '-q', '-of', 'JPEG', '-co', f'QUALITY={quality}', '-b', '1', '-b', '2', '-b', '3',
                        '-r', 'average', '-outsize', str(width), '0', '--config', 'GDAL_PAM_ENABLED', 'NO', source, target], check=True)
        if os.path.getsize(target) <= MOST_BYTES:
            break


def make(names, page):
    """Makes the pictures of one page, or of none."""
    with tempfile.TemporaryDirectory(prefix='terrace-pictures-') as folder:
        env = environment(folder)
        if page:
            with open(os.path.join(ROOT, page), encoding='utf-8') as file:
                Page(file.read(), folder, env, '/usr/bin/python3').run()
        for name in names:
            _, width, commands, file = PICTURES[name]
            subprocess.run(['bash', '-eu', '-c', CHROMIUM + '\n'.join(commands)], cwd=folder, env=env, check=True)
            target, source = os.path.join(OUT, name), os.path.join(folder, file)
            if name.endswith('.jpg') and file.endswith('.png'):
                reduce(source, target, width)
            else:
                shutil.copyfile(source, target)
            size = os.path.getsize(target)
            print(f'{name}: {size} bytes')
            if size > MOST_BYTES:
                sys.exit(f'{name} has {size} bytes, more than {MOST_BYTES}')


def main(names):
    unknown = set(names) - set(PICTURES)
    if unknown:
        sys.exit(f'unknown pictures: {", ".join(sorted(unknown))}')
    os.makedirs(OUT, exist_ok=True)
    pages = {}
    for name in names or PICTURES:
        pages.setdefault(PICTURES[name][0], []).append(name)
    for page, of_page in pages.items():
        make(of_page, page)


if __name__ == '__main__':
    main(sys.argv[1:])
