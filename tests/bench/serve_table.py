#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Range requests per second of `terrace view`, measured by wrk, next to nginx where it is installed.

Prints one Markdown table: requests per second for 64 KiB at random offsets of a store's largest file, the
99th percentile of the latency, and the peak resident set of the server (for nginx, of its one worker). All
values are medians of the runs. Client and server share the machine's cores, with one thread each.

usage: serve_table.py TERRACE [--store STORE] [--size 4096x4096] [--seconds 5] [--connections 32] [--runs 3]
"""
import argparse
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request

REQUESTS = """
local bytes, piece = %d, 65536
math.randomseed(1)
request = function()
  local from = math.random(0, math.max(0, bytes - piece))
  return wrk.format("GET", nil, {["Range"] = string.format("bytes=%%d-%%d", from, from + piece - 1)})
end
wrong = 0
response = function(status) if status ~= 206 then wrong = wrong + 1 end end
local threads = {}
setup = function(thread) table.insert(threads, thread) end
done = function(summary, latency)
  local all = 0
  for _, thread in ipairs(threads) do all = all + thread:get("wrong") end
  print(string.format("result %%f %%f %%d", summary.requests / summary.duration * 1e6, latency:percentile(99) / 1000, all))
end
"""
NGINX = """daemon off; worker_processes 1; pid %(folder)s/nginx.pid; error_log %(folder)s/error.log;
events { worker_connections 512; }
http { access_log off; sendfile on; keepalive_requests 100000000; client_body_temp_path %(folder)s; proxy_temp_path %(folder)s;
fastcgi_temp_path %(folder)s; uwsgi_temp_path %(folder)s; scgi_temp_path %(folder)s;
server { listen 127.0.0.1:%(port)d; root %(root)s; } }
"""


def peak_bytes(pid):
    with open(f'/proc/{pid}/status') as status:
        return int(re.search(r'VmHWM:\s+(\d+) kB', status.read())[1]) * 1024


def children(pid):
    with open(f'/proc/{pid}/task/{pid}/children') as file:
        return [int(word) for word in file.read().split()]


def wait_for(url):
    for _ in range(100):
        try:
            with urllib.request.urlopen(url) as answer:
                return answer.read()
        except OSError:
            time.sleep(0.05)
    sys.exit(f'nothing answers at {url}')


def load(url, script, options):
    output = subprocess.run(['wrk', '-t1', f'-c{options.connections}', f'-d{options.seconds}s', '-s', script, url],
                            capture_output=True, text=True, check=True).stdout
    rate, slow, wrong = re.search(r'^result (\S+) (\S+) (\S+)$', output, re.M).groups()
    if int(wrong) > 0 or 'Socket errors' in output:
        sys.exit(f'wrong answers:\n{output}')
    return float(rate), float(slow)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('terrace')
    parser.add_argument('--store')
    parser.add_argument('--size', default='4096x4096')
    parser.add_argument('--seconds', type=int, default=5)
    parser.add_argument('--connections', type=int, default=32)
    parser.add_argument('--runs', type=int, default=3)
    options = parser.parse_args()
    if shutil.which('wrk') is None:
        print('skipped: wrk is not installed')
        return
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)  # nginx changes its user
        store = options.store
        if store is None:
            store = os.path.join(folder, 'dem.store')
            dem = os.path.join(folder, 'dem.tif')
            subprocess.run([options.terrace, 'synth', 'dem', '--size', options.size, '-o', dem, '-q'], check=True)
            subprocess.run([options.terrace, 'build', dem, '-o', store, '-q'], check=True)
        store = os.path.abspath(store)
        name = max(os.listdir(store), key=lambda n: os.path.getsize(os.path.join(store, n)))
        script = os.path.join(folder, 'requests.lua')
        with open(script, 'w') as file:
            file.write(REQUESTS % os.path.getsize(os.path.join(store, name)))

        port = 18000 + os.getpid() % 10000
        view = subprocess.Popen([options.terrace, 'view', store, '--no-open', '--port', str(port)],
                                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        site, token = re.search(r'(http://\S+)/(\?token=\w+)', view.stderr.readline()).groups()
        shown = json.loads(wait_for(f'{site}/stores.json{token}'))['stores'][0]['name']
        servers = {'terrace view': (view, f'{site}/stores/{shown}/{name}{token}')}
        if shutil.which('nginx') is not None:
            config = os.path.join(folder, 'nginx.conf')
            with open(config, 'w') as file:
                file.write(NGINX % {'folder': folder, 'port': port + 1, 'root': store})
            nginx = subprocess.Popen(['nginx', '-p', folder, '-c', config], stderr=subprocess.DEVNULL)
            servers['nginx'] = (nginx, f'http://127.0.0.1:{port + 1}/{name}')
        try:
            results = {server: [] for server in servers}
            for server, (_, url) in servers.items():
                wait_for(url)
            for _ in range(options.runs):  # alternate the servers
                for server, (_, url) in servers.items():
                    results[server].append(load(url, script, options))
            print('| server | requests/s of 64 KiB | 99 % within, ms | peak MiB |\n|---|---|---|---|')
            for server, (process, _) in servers.items():
                peak = max(map(peak_bytes, [process.pid, *children(process.pid)]))
                print(f'| {server} | {statistics.median(r[0] for r in results[server]):,.0f} | '
                      f'{statistics.median(r[1] for r in results[server]):.1f} | {peak / 2**20:.0f} |')
        finally:
            for process, _ in servers.values():
                process.terminate()
                process.wait()


if __name__ == '__main__':
    main()
