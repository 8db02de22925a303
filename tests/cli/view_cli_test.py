#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests terrace view with hostile requests over raw sockets, and the output of terrace publish.

TERRACE=path/to/terrace view_cli_test.py [CLASS...]
"""

import gzip
import hashlib
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request
import zlib

TERRACE = os.environ.get('TERRACE', 'terrace')
ALPS = os.path.join(os.path.dirname(__file__), '..', '..', 'libterrain', 'examples', 'alps.tif')


def terrace(*args, **kwargs):
    return subprocess.run([TERRACE, *args], timeout=120, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **kwargs)


def view(*stores):
    """Starts the server; returns it, its port and the query with the token."""
    server = subprocess.Popen([TERRACE, 'view', *stores, '--no-open'], stderr=subprocess.PIPE, text=True)
    port, query = re.search(r'http://127\.0\.0\.1:(\d+)/(\?token=[0-9a-f]{32}) ', server.stderr.readline()).groups()
    return server, int(port), query


class Stores(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.store = os.path.join(cls.folder, 'alps.store')
        done = terrace('build', ALPS, '-o', cls.store, '-q')
        assert done.returncode == 0, done.stderr

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def path(self, *parts):
        return os.path.join(self.folder, *parts)

    def read(self, *parts):
        with open(self.path(*parts), 'rb') as file:
            return file.read()


class ViewTest(Stores):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.server, cls.port, cls.query = view(cls.store)

    @classmethod
    def tearDownClass(cls):
        cls.server.send_signal(signal.SIGINT)
        code = cls.server.wait(10)
        cls.server.stderr.close()
        super().tearDownClass()
        assert code == 0, code

    def connect(self):
        connection = socket.create_connection(('127.0.0.1', self.port), timeout=20)
        self.addCleanup(connection.close)
        return connection

    def answer(self, raw):
        """Sends bytes; returns everything received until the server closes or is silent for a while."""
        connection = self.connect()
        try:
            connection.sendall(raw)
            connection.shutdown(socket.SHUT_WR)
        except OSError:
            pass
        data = b''
        try:
            while piece := connection.recv(1 << 16):
                data += piece
        except ConnectionResetError:
            pass
        return data

    def get(self, path, method='GET', query=None, host=None, **headers):
        """Sends a request with the token and the right Host, unless others are given."""
        lines = ''.join(f'{name.replace("_", "-")}: {value}\r\n' for name, value in headers.items())
        target = path + (self.query if query is None else query)
        host = f'127.0.0.1:{self.port}' if host is None else host
        data = self.answer(f'{method} {target} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{lines}\r\n'.encode())
        head, _, body = data.partition(b'\r\n\r\n')
        status, *fields = head.decode().split('\r\n')
        return int(status.split()[1]), dict(field.split(': ', 1) for field in fields), body

    def data(self):
        with open(self.path('alps.store', 'level-0.0.clusters'), 'rb') as file:
            return file.read()

    URL = '/stores/alps/level-0.0.clusters'

    def test_files_have_their_types_and_lengths(self):
        for path, kind in [('/', 'text/html; charset=utf-8'), ('/viewer.js', 'text/javascript; charset=utf-8'),
                           ('/core.wasm', 'application/wasm'), ('/stores.json', 'application/json'),
                           ('/viewer.css', 'text/css; charset=utf-8'), (self.URL, 'application/octet-stream')]:
            status, headers, body = self.get(path)
            self.assertEqual((path, status, headers['Content-Type']), (path, 200, kind))
            self.assertEqual(int(headers['Content-Length']), len(body))
            self.assertEqual(self.get(path, 'HEAD')[::2], (200, b''))
        self.assertEqual(self.get(self.URL)[2], self.data())
        self.assertEqual(json.loads(self.get('/stores.json')[2])['stores'][0]['name'], 'alps')

    def test_ranges_are_served(self):
        data = self.data()
        size = len(data)
        for text, begin, end in [('0-0', 0, 1), ('5-99', 5, 100), (f'{size - 3}-', size - 3, size), ('-7', size - 7, size),
                                 (f'10-{size + 100}', 10, size), (f'0-{200_000}', 0, 200_001)]:
            status, headers, body = self.get(self.URL, Range=f'bytes={text}')
            self.assertEqual((text, status, headers['Content-Range']), (text, 206, f'bytes {begin}-{end - 1}/{size}'))
            self.assertEqual(body, data[begin:end])
        status, headers, _ = self.get(self.URL, Range=f'bytes={size}-')
        self.assertEqual((status, headers['Content-Range']), (416, f'bytes */{size}'))
        for text in ['bytes=0-1,5-6', 'bytes=9-3', 'lines=0-1', 'bytes=x']:
            self.assertEqual(self.get(self.URL, Range=text)[0], 200)
        tag = self.get(self.URL, 'HEAD')[1]['ETag']
        self.assertEqual(self.get(self.URL, Range='bytes=0-1', If_Range=tag)[0], 206)
        self.assertEqual(self.get(self.URL, Range='bytes=0-1', If_Range='"x"')[0], 200)
        self.assertEqual(self.get(self.URL, If_None_Match=tag)[::2], (304, b''))

    def test_pages_of_other_origins_cannot_read(self):
        """They get no permission to read; a page redirected here by DNS has another Host."""
        self.assertEqual(self.get('/', 'OPTIONS', Origin='http://evil.example', Access_Control_Request_Method='GET')[0], 405)
        for path in ['/', '/stores.json', self.URL, '/nothing']:
            headers = self.get(path, Origin='http://evil.example')[1]
            self.assertEqual([name for name in headers if name.lower().startswith('access-control-')], [])
            self.assertEqual(headers['Cross-Origin-Resource-Policy'], 'same-origin')
            self.assertEqual(headers['Referrer-Policy'], 'no-referrer')
        for host in ['127.0.0.1', 'localhost', 'LocalHost', '[::1]']:
            self.assertEqual((host, self.get('/stores.json', host=f'{host}:{self.port}')[0]), (host, 200))
        for host in ['', 'evil.example', f'evil.example:{self.port}', f'localhost.evil.example:{self.port}', f'127.0.0.1.evil:{self.port}',
                     '127.0.0.1', f'127.0.0.1:{self.port + 1}', f'x@127.0.0.1:{self.port}', f':{self.port}', f'[::1]:{self.port}.evil']:
            for path in ['/', '/stores.json']:
                self.assertEqual((host, self.get(path, host=host)[0]), (host, 403))
        self.assertIn(b' 403 ', self.answer(f'GET /stores.json{self.query} HTTP/1.0\r\n\r\n'.encode()).split(b'\r\n')[0])

    def test_other_users_of_the_port_need_the_token(self):
        """Stores need the token in the address; the viewer's own files do not."""
        token = self.query.removeprefix('?token=')
        for query in ['', '?', '?token', '?token=', f'?token={token[:-1]}', f'?token={token}0', f'?token={token.upper()}x', f'?x={token}',
                      f'?tokens={token}', '?token=' + '0' * 32, f'#?token={token}', f'?x=1&token={token[1:]}']:
            for path in ['/stores.json', '/stores/alps.start', '/stores/alps/manifest.json', self.URL, '/stores/alps/nothing', '/nothing']:
                # Requests like a browser's, because programs of this session need no token.
                status, _, body = self.get(path, query=query, Sec_Fetch_Site='none')
                self.assertEqual((query, path, status, body), (query, path, 403, b'no token\n'))
        for path in ['/', '/index.html', '/viewer.js', '/viewer.css', '/worker.js', '/core.wasm', '/body.wasm']:
            self.assertEqual((path, self.get(path, query='')[0]), (path, 200))
        self.assertEqual(self.get('/stores.json', query=f'?x=1&token={token}')[0], 200)
        # Programs of the same session, such as a command typed in the same terminal, are served;
        # others are not.
        ask = [sys.executable, '-c', 'import sys, urllib.request; print(urllib.request.urlopen(sys.argv[1]).status)',
               f'http://127.0.0.1:{self.port}/stores.json']
        for strange in False, True:
            done = subprocess.run(ask, capture_output=True, text=True, timeout=60, start_new_session=strange)
            self.assertEqual(done.stdout, '' if strange else '200\n', done.stderr)
        for name in 'Origin', 'Referer', 'Sec_Fetch_Site':
            self.assertEqual(self.get('/stores.json', query='', **{name: 'http://evil.example'})[0], 403)
        self.assertEqual(self.get('/stores.json', query='')[0], 200)
        other, _, query = view(self.store)
        other.send_signal(signal.SIGINT)
        other.wait(10)
        other.stderr.close()
        self.assertNotEqual(query, self.query)

    def test_ctrl_c_prints_the_summary_of_a_server(self):
        with subprocess.Popen([TERRACE, 'view', self.store, '--no-open', '--json'], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True) as server:
            server.stderr.readline()
            server.send_signal(signal.SIGINT)
            out, error = server.communicate(timeout=20)
        self.assertEqual((server.returncode, error), (0, ''))
        self.assertEqual(json.loads(out)['stores'], 1)

    def test_the_content_security_policy(self):
        """The page and the server have the same policy: nothing from elsewhere, and no inline script."""
        _, headers, page = self.get('/')
        policy = re.search(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)">', page.decode()).group(1)
        self.assertEqual(headers['Content-Security-Policy'], policy)
        self.assertIn("default-src 'none'", policy)
        self.assertIn("script-src 'self' 'wasm-unsafe-eval';", policy)
        self.assertNotIn('unsafe-inline', policy)
        self.assertNotIn("'unsafe-eval'", policy)
        script = self.get('/viewer.js')[2].decode()
        for word in ['innerHTML', 'outerHTML', 'insertAdjacentHTML', 'document.write', 'eval(']:
            self.assertNotIn(word, script)

    def test_no_path_leaves_the_store(self):
        for path in ['/../../etc/passwd', '/stores/alps/../../../../etc/passwd', '/stores/alps/%2e%2e/%2e%2e/etc/passwd',
                     '/stores/alps/..%2f..%2fetc%2fpasswd', '//etc/passwd', '/stores/alps/', '/stores/', '/stores/alps',
                     '/stores/alps/./manifest.json', '/stores/alps/manifest.json/', '/%252e%252e/etc/passwd', '/etc/passwd']:
            self.assertEqual((path, self.get(path)[0]), (path, 404))
        for path in ['/%00', '/%zz', 'etc/passwd', '*']:
            self.assertEqual((path, self.get(path)[0]), (path, 400))

    def test_hostile_requests_are_rejected(self):
        def status(raw):
            data = self.answer(raw)
            return int(data.split()[1]) if data else None

        self.assertEqual(status(b'GET / HTTP/1.1\r\nX: ' + b'a' * 20_000 + b'\r\n\r\n'), 431)
        self.assertEqual(status(b'GET /' + b'a' * 20_000 + b' HTTP/1.1\r\n\r\n'), 431)
        self.assertEqual(status(b'\0\1\2\3\r\n\r\n'), 400)
        self.assertEqual(status(b'GET / HTTP/9.9\r\n\r\n'), 400)
        self.assertEqual(status(b'GET  HTTP/1.1\r\n\r\n'), 400)
        self.assertEqual(status(b'\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03' + b'\0' * 200), 400)
        self.assertEqual(self.get('/', 'POST', Content_Length='5')[0], 413)
        self.assertEqual(self.get('/', 'DELETE')[0], 405)
        self.assertIsNone(status(b'GET / HT'))
        # It still serves.
        self.assertEqual(self.get('/')[0], 200)

    def test_one_connection_serves_many_requests(self):
        connection = self.connect()
        data = self.data()
        # Sent all at once, and answered in order.
        connection.sendall(b''.join(
            f'GET {self.URL}{self.query} HTTP/1.1\r\nHost: localhost:{self.port}\r\nRange: bytes={i}-{i + 9}\r\n\r\n'.encode()
            for i in range(50)))
        stream = connection.makefile('rb')
        for i in range(50):
            self.assertEqual(stream.readline(), b'HTTP/1.1 206 Partial Content\r\n')
            while stream.readline() != b'\r\n':
                pass
            self.assertEqual(stream.read(10), data[i:i + 10])
        stream.close()

    def test_several_host_headers_are_rejected(self):
        for hosts in ([self.port, self.port], [self.port, 1], [1, self.port]):
            lines = ''.join(f'Host: localhost:{port}\r\n' for port in hosts)
            answer = self.answer(f'GET /{self.query} HTTP/1.1\r\n{lines}Connection: close\r\n\r\n'.encode())
            self.assertIn(b' 400 ', answer.split(b'\r\n')[0])

    def test_slow_clients_do_not_block_others(self):
        idle = [self.connect() for _ in range(60)]
        for i, connection in enumerate(idle):
            if i % 3 == 0:
                connection.sendall(b'GET / HT')  # and nothing else
            elif i % 3 == 1:
                # This one never reads.
                connection.sendall(f'GET {self.URL}{self.query} HTTP/1.1\r\nHost: localhost:{self.port}\r\n\r\n'.encode())
        begin = time.monotonic()
        self.assertEqual(len(self.get(self.URL)[2]), len(self.data()))
        self.assertLess(time.monotonic() - begin, 5)

    def test_idle_connections_do_not_lock_others_out(self):
        """Their number is limited; those that have waited longest for a request are closed."""
        crowd = []
        try:
            for i in range(300):
                crowd.append(socket.create_connection(('127.0.0.1', self.port), timeout=20))
                if i % 2:
                    crowd[-1].sendall(b'GET / HT')  # and nothing else
            for _ in range(3):
                self.assertEqual(len(self.get(self.URL)[2]), len(self.data()))
            self.assertEqual(crowd[0].recv(100), b'')
            crowd[-2].sendall(f'GET / HTTP/1.1\r\nHost: localhost:{self.port}\r\n\r\n'.encode())
            self.assertIn(b' 200 ', crowd[-2].recv(100))
        finally:
            for connection in crowd:
                connection.close()
        for _ in range(100):
            if self.get('/')[0] == 200:
                return
            time.sleep(0.05)
        self.fail('it does not recover')


class ReplacedTest(Stores):
    def build(self, *args):
        result = terrace('build', ALPS, '-o', self.store, '-q', '--force', *args)
        self.assertEqual(result.returncode, 0, result.stderr)

    def file(self, name):
        with open(os.path.join(self.store, name), 'rb') as data:
            return data.read()

    def connections_of(self, count):
        """Starts a server of the store. Returns connections to it and a function that sends a request to one:
        ask(connection, path, lines) returns the status and the header fields, without reading the body."""
        server, port, query = view(self.store)

        def stop():
            server.send_signal(signal.SIGINT)
            code = server.wait(10)
            server.stderr.close()
            self.assertEqual(code, 0)

        self.addCleanup(stop)

        def ask(connection, path, lines=''):
            connection.sendall(f'GET {path}{query} HTTP/1.1\r\nHost: localhost:{port}\r\n{lines}\r\n'.encode())
            head = b''
            while not head.endswith(b'\r\n\r\n'):
                head += connection.recv(1)
            status, *fields = head.decode().strip().split('\r\n')
            return int(status.split()[1]), dict(field.split(': ', 1) for field in fields)

        connections = [socket.create_connection(('127.0.0.1', port), timeout=20) for _ in range(count)]
        for connection in connections:
            self.addCleanup(connection.close)
        return connections, ask

    def receive(self, connection, size):
        data = b''
        while len(data) < size:
            chunk = connection.recv(size - len(data))
            self.assertTrue(chunk)
            data += chunk
        return data

    URL, NAME = '/stores/alps/', 'level-0.0.clusters'

    def test_a_replaced_store_is_served(self):
        """Open connections get the new store too, while a running download continues with the old one."""
        self.build('--block', '1000')
        (first, second), ask = self.connections_of(2)
        old = self.file(self.NAME)
        _, fields = ask(first, self.URL + self.NAME)
        self.assertEqual(int(fields['Content-Length']), len(old))
        self.build('--block', '2000')
        new = self.file(self.NAME)
        self.assertNotEqual(new, old)
        status, fresh = ask(second, self.URL + self.NAME,
                            f'Range: bytes=0-99\r\nIf-None-Match: {fields["ETag"]}\r\n')
        self.assertEqual((status, fresh['Content-Range']), (206, f'bytes 0-99/{len(new)}'))
        self.assertNotEqual(fresh['ETag'], fields['ETag'])
        self.assertEqual(self.receive(second, 100), new[:100])
        self.assertEqual(self.receive(first, len(old)), old)
        for path, expected in [('manifest.json', self.file('manifest.json')), (self.NAME, new)]:
            _, head = ask(first, self.URL + path)
            self.assertEqual(self.receive(first, int(head['Content-Length'])), expected)
        _, head = ask(first, '/stores.json')
        checksum = json.loads(self.receive(first, int(head['Content-Length'])))['stores'][0]['checksum']
        self.assertTrue(fresh['ETag'].startswith(f'"{checksum}-'))

    def test_the_last_store_is_served_while_there_is_none(self):
        self.build('--block', '2000')
        (connection,), ask = self.connections_of(1)
        old = self.file(self.NAME)

        def tag():
            _, fields = ask(connection, self.URL + self.NAME, 'Range: bytes=0-99\r\n')
            self.assertEqual(self.receive(connection, 100), expected[:100])
            return fields['ETag']

        expected = old
        old_tag = tag()
        os.rename(self.store, self.path('away'))
        self.assertEqual(tag(), old_tag)
        os.mkdir(self.store)
        with open(os.path.join(self.store, 'manifest.json'), 'w') as manifest:
            manifest.write('{')
        self.assertEqual(tag(), old_tag)
        shutil.rmtree(self.store)
        self.build('--block', '1000')
        expected = self.file(self.NAME)
        self.assertNotEqual(tag(), old_tag)

    def test_a_store_overwritten_in_place_is_served_once_complete(self):
        """The files are overwritten one by one, in any order."""
        def build_store(name, *args):
            done = terrace('build', ALPS, '-o', self.path(name), '-q', *args)
            self.assertEqual(done.returncode, 0, done.stderr)
            return {file: self.read(name, file) for file in os.listdir(self.path(name))}

        shown, other = build_store('shown.store', '--block', '1000'), build_store('other.store', '--seed', '7', '--block', '2000')
        server, port, query = view(self.path('shown.store'))
        address = f'http://127.0.0.1:{port}/'

        def fetch(path):
            with urllib.request.urlopen(address + path + query, timeout=20) as answer:
                return answer.read()

        try:
            for target, manifest_first in [(other, True), (shown, False), (other, False), (shown, True)]:
                names = sorted(target, key=lambda name: (name == 'manifest.json') != manifest_first)
                for name in names:
                    fetch('stores.json')  # finds files of two stores
                    with open(self.path('shown.store', name), 'wb') as file:  # like cp
                        file.write(target[name])
                for name in set(os.listdir(self.path('shown.store'))) - set(target):
                    os.remove(self.path('shown.store', name))
                checksum = json.loads(target['manifest.json'])['checksum'].lstrip('0')
                for _ in range(600):
                    if json.loads(fetch('stores.json'))['stores'][0]['checksum'] == checksum and \
                            all(fetch(f'stores/shown/{name}') == data for name, data in target.items()):
                        break
                    time.sleep(0.05)
                else:
                    self.fail(f'the store is not served, manifest first: {manifest_first}')
        finally:
            server.send_signal(signal.SIGINT)
            server.wait(10)
            server.stderr.close()


class ViewErrorTest(Stores):
    def test_wrong_usage_and_taken_ports_are_errors(self):
        self.assertEqual(terrace('view').returncode, 2)
        self.assertEqual(terrace('view', self.path('nothing')).returncode, 1)
        self.assertEqual(terrace('view', self.store, '--port', '70000').returncode, 2)
        with socket.create_server(('127.0.0.1', 0)) as taken:
            done = terrace('view', self.store, '--no-open', '--port', str(taken.getsockname()[1]))
            self.assertEqual(done.returncode, 1)
            self.assertIn('another port', done.stderr)

    def test_a_manifest_with_unknown_words_is_rejected(self):
        """Every verb rejects a manifest with a correct checksum but unknown words, such as markup."""
        for key, value in [('"vertical": "', '<b>x</b>'), ('"kind": "', '<i>'), ('"parameters": [', None)]:
            store = self.path('words.store')
            shutil.copytree(self.store, store)
            text = self.read('words.store', 'manifest.json').decode()
            if value is None:
                text = text.replace(key, key + '\n    {\n      "name": "entities",\n      "value": "<img src=x onerror=alert(1)>"\n    },', 1)
            else:
                text = re.sub(f'({key})[a-z]*"', lambda match: f'{match[1]}{value}"', text, count=1)
            end = '"\n}\n'
            text = text[:-len(end) - 8] + '00000000' + end
            text = text[:-len(end) - 8] + f'{zlib.crc32(text.encode()):08x}' + end
            with open(os.path.join(store, 'manifest.json'), 'w') as file:
                file.write(text)
            for verb in [['view', store, '--no-open'], ['verify', store], ['info', store], ['publish', store, '-o', self.path('no')]]:
                done = terrace(*verb)
                self.assertEqual((key, verb[0], done.returncode), (key, verb[0], 1))
                self.assertRegex(done.stderr + done.stdout, 'damaged manifest: .* unknown')
            shutil.rmtree(store)

    def test_links_are_not_served(self):
        store = self.path('linked.store')
        shutil.copytree(self.store, store)
        os.rename(os.path.join(store, 'level-0.0.clusters'), self.path('elsewhere'))
        os.symlink(self.path('elsewhere'), os.path.join(store, 'level-0.0.clusters'))
        for verb in [['view', store, '--no-open'], ['publish', store, '-o', self.path('no')]]:
            done = terrace(*verb)
            self.assertEqual(done.returncode, 1)
            self.assertIn('links are not served', done.stderr)
        self.assertFalse(os.path.exists(self.path('no')))


class PublishTest(Stores):
    def digest(self, *parts):
        with open(self.path(*parts), 'rb') as file:
            return hashlib.sha256(file.read()).hexdigest()

    def test_publish(self):
        done = terrace('publish', self.store, self.store, '-o', self.path('site'), '--json')
        self.assertEqual(done.returncode, 0, done.stderr)
        summary = json.loads(done.stdout)
        files = [os.path.join(folder, name) for folder, _, names in os.walk(self.path('site')) for name in names]
        self.assertEqual(summary['files'], len(files))
        self.assertEqual(summary['bytes'], sum(os.path.getsize(file) for file in files))
        with open(self.path('site', 'stores.json')) as file:
            self.assertEqual([store['name'] for store in json.load(file)['stores']], ['alps', 'alps-2'])
        for name in os.listdir(self.store):
            self.assertEqual(self.digest('site', 'stores', 'alps', name), self.digest('alps.store', name))
        self.assertEqual(terrace('verify', self.path('site', 'stores', 'alps')).returncode, 0)
        # The viewer's own files are within their size limits.
        own = ['body.wasm', 'core.wasm', 'index.html', 'viewer.css', 'viewer.js', 'worker.js']
        packed = {}
        for name in own:
            with open(self.path('site', name), 'rb') as file:
                packed[name] = len(gzip.compress(file.read(), 9))
        self.assertLessEqual(sum(os.path.getsize(self.path('site', name)) for name in own), 1_160_000)
        self.assertLessEqual(sum(packed.values()), 480_000)
        self.assertLessEqual(max(packed.values()), 240_000)
        self.assertLess(os.path.getsize(self.path('site', 'stores', 'alps.start')), 300_000)
        # Nothing else is left next to it.
        self.assertEqual([name for name in os.listdir(self.folder) if name.startswith('.')], [])

    def test_colliding_names_are_changed(self):
        """A store is a folder and a start file next to it, so x and x.start get other names, in view too."""
        for name in 'x', 'x.start':
            shutil.copytree(self.store, self.path(f'{name}.store'))
        for number, order in enumerate([['x', 'x.start'], ['x.start', 'x']]):
            site = self.path(f'met{number}')
            done = terrace('publish', *(self.path(f'{name}.store') for name in order), '-o', site)
            self.assertEqual(done.returncode, 0, done.stderr)
            names = [store['name'] for store in json.loads(self.read(site, 'stores.json'))['stores']]
            self.assertEqual(names, [order[0], f'{order[1]}-2'])
            for name in names:
                self.assertEqual(terrace('verify', os.path.join(site, 'stores', name)).returncode, 0)
                self.assertTrue(os.path.isfile(os.path.join(site, 'stores', f'{name}.start')))

    def test_the_start_file_lists_the_classes_of_a_cloud(self):
        """The start file lists the classes of all points for the legend, not only of the coarsest."""
        rows = ['x,y,z,classification'] + [f'{i % 100},{i // 100},0,{7 if i == 5000 else 18 if i == 7777 else 2 + i % 2}' for i in range(20_000)]
        with open(self.path('cloud.csv'), 'w') as file:
            file.write('\n'.join(rows) + '\n')
        self.assertEqual(terrace('build', self.path('cloud.csv'), '-o', self.path('cloud.store'), '-q').returncode, 0)
        self.assertEqual(terrace('publish', self.path('cloud.store'), '-o', self.path('classes'), '-q').returncode, 0)
        self.assertEqual(json.loads(self.read('classes', 'stores', 'cloud.start').partition(b'\n')[0])['classes'], [2, 3, 7, 18])

    def test_repack_keeps_the_points(self):
        """The repacked store has the same points and name, is valid, and does not depend on threads."""
        for threads in '1', '3':
            done = terrace('publish', self.store, self.store, '-o', self.path(f'repacked{threads}'), '--repack', '--json',
                           '--threads', threads)
            self.assertEqual(done.returncode, 0, done.stderr)
        summary = json.loads(done.stdout)
        files = sorted(os.path.relpath(os.path.join(folder, name), self.path('repacked3'))
                       for folder, _, names in os.walk(self.path('repacked3')) for name in names)
        terrace('publish', self.store, self.store, '-o', self.path('plain'), '-q')
        self.assertEqual(files, sorted(os.path.relpath(os.path.join(folder, name), self.path('plain'))
                                       for folder, _, names in os.walk(self.path('plain')) for name in names))
        self.assertEqual(summary['files'], len(files))
        self.assertEqual(summary['bytes'], sum(os.path.getsize(self.path('repacked3', file)) for file in files))
        for file in files:
            self.assertEqual(self.digest('repacked1', file), self.digest('repacked3', file), file)
        self.assertEqual(self.digest('repacked3', 'stores', 'alps', 'manifest.json'),
                         self.digest('repacked3', 'stores', 'alps-2', 'manifest.json'))
        packed = self.path('repacked3', 'stores', 'alps')
        self.assertNotEqual(self.digest('repacked3', 'stores', 'alps', 'level-0.0.clusters'), self.digest('alps.store', 'level-0.0.clusters'))
        self.assertEqual(terrace('verify', packed).returncode, 0)
        points = []
        for store in self.store, packed:
            done = terrace('points', store, '--level', '0', '-o', '-', '--format', 'xyz')
            self.assertEqual(done.returncode, 0, done.stderr)
            points.append(sorted(done.stdout.splitlines()))
        self.assertEqual(*points)
        self.assertEqual([name for name in os.listdir(self.folder) if name.startswith('.')], [])
        # A failure on the way leaves no files.
        damaged = self.path('damaged.store')
        shutil.copytree(self.store, damaged)
        with open(os.path.join(damaged, 'level-0.0.clusters'), 'r+b') as file:
            file.seek(1000)
            file.write(b'damage')
        done = terrace('publish', damaged, '-o', self.path('spoiled'), '--repack')
        self.assertEqual(done.returncode, 1)
        self.assertIn('checksum', done.stderr)
        self.assertFalse(os.path.exists(self.path('spoiled')))
        self.assertEqual([name for name in os.listdir(self.folder) if name.startswith('.')], [])

    def test_the_start_file_has_parts_of_the_store(self):
        terrace('publish', self.store, '-o', self.path('started'), '-q')
        with open(self.path('started', 'stores', 'alps.start'), 'rb') as file:
            head, _, data = file.read().partition(b'\n')
        head = json.loads(head)
        self.assertEqual((head['format'], head['version'], len(head['ground'])), ('terrace-start', 2, 9))
        data = zlib.decompress(data)
        for name, offset, size in head['parts']:
            with open(os.path.join(self.store, name), 'rb') as file:
                file.seek(offset)
                self.assertEqual(file.read(size), data[:size])
            data = data[size:]
        self.assertEqual(data, b'')

    def test_force_replaces_only_published_folders(self):
        site = self.path('again')
        self.assertEqual(terrace('publish', self.store, '-o', site, '-q').returncode, 0)
        self.assertEqual(terrace('publish', self.store, '-o', site, '-q').returncode, 1)
        os.utime(os.path.join(site, 'index.html'), (0, 0))
        self.assertEqual(terrace('publish', self.store, '-o', site, '-q', '--force').returncode, 0)
        self.assertGreater(os.path.getmtime(os.path.join(site, 'index.html')), 0)
        other = self.path('foreign')
        os.mkdir(other)
        with open(os.path.join(other, 'stores.json'), 'w') as file:
            file.write('{"text": "terrace-stores"}')
        done = terrace('publish', self.store, '-o', other, '--force')
        self.assertEqual(done.returncode, 1)
        self.assertIn('was not written by terrace', done.stderr)
        self.assertEqual(os.listdir(other), ['stores.json'])
        self.assertEqual(terrace('publish', self.store, '-o', self.path('no', 'parent')).returncode, 1)

    def test_a_published_folder_with_a_foreign_file_is_kept(self):
        site = self.path('shared')
        self.assertEqual(terrace('publish', self.store, '-o', site, '-q').returncode, 0)
        self.assertEqual(terrace('publish', self.store, self.store, '-o', site, '-q', '--force').returncode, 0)
        for name in ('robots.txt', 'stores/notes.txt', 'stores/alps/notes.txt', 'stores/alps-3.start', 'own/index.html'):
            path = os.path.join(site, name)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, 'w') as file:
                file.write('precious')
            done = terrace('publish', self.store, '-o', site, '--force')
            with self.subTest(name):
                self.assertEqual(done.returncode, 1)
                self.assertIn(f"contains {name.replace('own/index.html', 'own')}, which terrace did not write", done.stderr)
                self.assertEqual(self.read(path), b'precious')
            os.remove(path)
        os.rmdir(os.path.join(site, 'own'))
        self.assertEqual(terrace('publish', self.store, '-o', site, '-q', '--force').returncode, 0)

    def test_a_store_inside_the_folder_it_would_replace(self):
        site = self.path('own')
        self.assertEqual(terrace('publish', self.store, '-o', site, '-q').returncode, 0)
        done = terrace('publish', os.path.join(site, 'stores', 'alps'), '-o', site, '-q', '--force')
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(terrace('verify', os.path.join(site, 'stores', 'alps')).returncode, 0)


if __name__ == '__main__':
    unittest.main()
