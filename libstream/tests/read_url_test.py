# SPDX-License-Identifier: Apache-2.0
"""Reads files over HTTP from a server of the test, which counts requests and fails on demand."""
import os
import random
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from range_server import RangeServer  # noqa: E402

READ_URL = os.environ['READ_URL']
KIB, MIB = 1 << 10, 1 << 20
SEED = random.randrange(1 << 32)
ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith('AWS_') and 'proxy' not in name.lower()}
ENVIRONMENT['AWS_EC2_METADATA_DISABLED'] = 'true'
ENVIRONMENT['HOME'] = '/nonexistent'


class Reader:
    """The program that reads, as a child."""

    def __init__(self, url, deadline_ms=20000, cache=64 * MIB, environment=None):
        self.child = subprocess.Popen([READ_URL, url, str(deadline_ms), str(cache)], stdin=subprocess.PIPE,
                                      stdout=subprocess.PIPE, text=True, env={**ENVIRONMENT, **(environment or {})})

    def __call__(self, *words):
        self.child.stdin.write(' '.join(str(word) for word in words) + '\n')
        self.child.stdin.flush()
        return self.child.stdout.readline().rstrip('\n')

    def read(self, *words):
        answer = self('read', *words)
        return answer if answer.startswith('error') else bytes.fromhex(answer)

    def close(self):
        self.child.stdin.close()
        self.child.stdout.close()
        self.child.wait()


class ReadUrl(unittest.TestCase):
    def setUp(self):
        rng = random.Random(SEED)
        self.data = rng.randbytes(3 * MIB)
        self.small = rng.randbytes(1000)
        self.server = RangeServer({'/s/big': self.data, '/s/small': self.small, '/s/empty': b''})
        self.addCleanup(self.server.close)

    def reader(self, url=None, **options):
        reader = Reader(url or self.server.url + '/s', **options)
        self.addCleanup(reader.close)
        return reader

    def test_small_and_empty_files_need_one_request(self):
        reader = self.reader()
        self.assertEqual(reader('open', 'small'), '1000')
        self.assertEqual(reader.read('small', 0, 1000), self.small)
        self.assertEqual(reader.read('small', 990, 10), self.small[990:])
        self.assertEqual(reader('open', 'empty'), '0')
        self.assertEqual(len(self.server.requests), 2)

    def test_random_reads_give_the_bytes_of_the_file(self):
        rng = random.Random(SEED)
        # A cache that is smaller than the file.
        reader = self.reader(cache=1)
        reader('open', 'big')
        for _ in range(60):
            size = rng.choice([1, 100, 5000, 70 * KIB, 300 * KIB, 2 * MIB])
            first = rng.randrange(len(self.data) - size)
            self.assertEqual(reader.read('big', first, size), self.data[first:first + size], f'seed {SEED}')

    def test_connections_are_kept(self):
        reader = self.reader()
        reader('open', 'big')
        for i in range(20):
            reader.read('big', 100000 + i * 100000, 10)
        self.assertEqual(len(self.server.requests), 21)
        self.assertLess(self.server.connections, 3)

    def test_sequential_reads_need_few_requests(self):
        reader = self.reader()
        reader('open', 'big')
        for first in range(0, 3 * MIB, 32 * KIB):
            self.assertEqual(reader.read('big', first, 32 * KIB), self.data[first:first + 32 * KIB])
        self.assertLess(len(self.server.requests), 12)
        self.assertLess(self.server.sent, 3.1 * MIB)

    def test_bytes_of_a_prefetch_are_requested_once_and_gaps_are_joined(self):
        reader = self.reader()
        reader('open', 'big')
        self.server.clear()
        parts = [(200 * KIB, 100), (200 * KIB + 1000, 100), (201 * KIB, 5000), (2 * MIB, 100 * KIB), (2 * MIB + 110 * KIB, 100 * KIB)]
        self.assertEqual(reader('prefetch', 'big', *(n for part in parts for n in part)), 'ok')
        self.assertEqual(len(self.server.requests), 2)
        for first, size in parts:
            self.assertEqual(reader.read('big', first, size), self.data[first:first + size])
        self.assertEqual(len(self.server.requests), 2)

    def test_gaps_cost_at_most_a_quarter(self):
        rng = random.Random(SEED)
        for _ in range(5):
            reader = self.reader()
            reader('open', 'big')
            self.server.clear()
            firsts = sorted(rng.sample(range(64 * KIB, 3 * MIB - 20 * KIB, 20 * KIB), rng.randint(1, 40)))
            parts = [(first, rng.randint(1, 20 * KIB)) for first in firsts]
            reader('prefetch', 'big', *(n for part in parts for n in part))
            needed = sum(size for _, size in parts)
            most = needed + max(64 * KIB, needed // 4) + len(parts) * 4 * KIB
            self.assertLessEqual(self.server.sent, most, f'seed {SEED}')
            for first, size in parts:
                self.assertEqual(reader.read('big', first, size), self.data[first:first + size], f'seed {SEED}')

    def test_threads_request_the_same_bytes_once(self):
        reader = self.reader()
        reader('open', 'big')
        self.server.clear()
        self.assertEqual(bytes.fromhex(reader('threads', 'big', MIB, 1000)), self.data[MIB:MIB + 1000])
        self.assertEqual(len(self.server.requests), 1)

    def test_a_server_without_ranges_gives_small_files_only(self):
        self.server.ranges = False
        reader = self.reader()
        self.assertEqual(reader('open', 'small'), '1000')
        self.assertEqual(reader.read('small', 10, 10), self.small[10:20])
        self.assertIn('whole file instead of the range', reader('open', 'big'))

    def test_faults_are_repeated(self):
        for answers in ([503, 503], [500, 429, 408], ['cut'], ['reset', 'reset'], ['short', 'cut', 503, 'reset']):
            with self.subTest(answers=answers):
                reader = self.reader()
                reader('open', 'big')
                self.server.answers = list(answers)
                self.server.clear()
                self.assertEqual(reader.read('big', MIB, 1000), self.data[MIB:MIB + 1000])
                self.assertEqual(len(self.server.requests), len(answers) + 1)

    def test_faults_end_at_the_deadline(self):
        self.server.access = lambda handler: 503
        answer = self.reader(deadline_ms=300)('open', 'big')
        self.assertIn('status 503', answer)
        self.assertGreater(len(self.server.requests), 1)

    def test_refusals_are_not_repeated(self):
        for status, words in ((403, 'denies access'), (404, 'no such file'), (400, 'status 400'), (501, 'status 501')):
            self.server.access = lambda handler, status=status: status
            self.server.clear()
            self.assertIn(words, self.reader()('open', 'big'))
            self.assertEqual(len(self.server.requests), 1)

    def test_a_host_that_does_not_exist_is_an_error_at_once(self):
        answer = self.reader('http://terrace.invalid/s')('open', 'big')
        self.assertIn('terrace.invalid', answer)
        self.assertIn('cannot read from the server', answer)

    def test_a_closed_port_is_an_error_at_once(self):
        self.server.close()
        self.assertIn('cannot read from the server', self.reader()('open', 'big'))

    def test_a_changed_file_is_an_error(self):
        for etags in ('strong', 'weak', 'none'):
            for heeded in (True, False):
                with self.subTest(etags=etags, heeded=heeded):
                    self.server.etags, self.server.checks_match = etags, heeded
                    self.server.files['/s/big'], self.server.modified = self.data, 'Sat, 28 Nov 2026 12:00:00 GMT'
                    reader = self.reader()
                    reader('open', 'big')
                    self.server.files['/s/big'] = bytes(len(self.data))
                    self.server.modified = 'Sat, 28 Nov 2026 12:00:05 GMT'
                    self.assertIn('has changed on the server', reader('read', 'big', MIB, 10))
                    self.server.files['/s/big'] = self.data[:MIB]
                    self.assertIn('has changed on the server', reader('read', 'big', 2 * MIB, 10))
                    del self.server.files['/s/big']
                    self.assertIn('no longer has the file', reader('read', 'big', MIB, 10))
                    self.server.files['/s/big'] = self.data

    def test_strong_tags_are_sent_back(self):
        reader = self.reader()
        reader('open', 'big')
        reader.read('big', MIB, 10)
        self.assertTrue(self.server.requests[1][3]['if-match'].startswith('"'))

    def test_secrets_are_sent_and_never_shown(self):
        host = self.server.url.partition('//')[2]
        reader = self.reader(f'http://someone:hush@{host}/s?signature=hidden')
        self.assertEqual(reader('open', 'small'), '1000')
        self.assertTrue(self.server.requests[0][3]['authorization'].startswith('Basic '))
        self.server.access = lambda handler: 403
        answer = reader('open', 'big')
        self.assertTrue(answer.startswith(f'error: {self.server.url}/s/big: '), answer)
        for secret in ('hush', 'hidden', 'someone'):
            self.assertNotIn(secret, answer)

    def test_malformed_urls_are_errors(self):
        for url in ('http://', 's3://', 'https:///path', 'ftp://host/x', 'http://host/\ttab'):
            self.assertTrue(self.reader(url)('open', 'big').startswith('error: '), url)


class QueryStore(unittest.TestCase):
    """Queries of stores that the repository has. The folder gives the right answers."""

    STORES = os.path.join(os.path.dirname(os.path.abspath(__file__)), 'data', 'stores')

    def setUp(self):
        self.names = [name for name in sorted(os.listdir(self.STORES)) if os.path.isdir(os.path.join(self.STORES, name))]
        files = {}
        for name in self.names:
            for file in os.listdir(os.path.join(self.STORES, name)):
                with open(os.path.join(self.STORES, name, file), 'rb') as opened:
                    files[f'/{name}/{file}'] = opened.read()
        self.server = RangeServer(files)
        self.addCleanup(self.server.close)

    def test_queries_are_as_in_a_folder(self):
        for name in self.names:
            local, remote = Reader(os.path.join(self.STORES, name)), Reader(f'{self.server.url}/{name}')
            for query in (['store'], ['store', 3, 2, 9, 11], ['store', 3, 2, 9, 11, 1]):
                self.assertEqual(remote(*query), local(*query), name)
            local.close()
            remote.close()

    def test_opening_requests_the_manifest_then_indices_and_top_together(self):
        reader = Reader(f'{self.server.url}/grid')
        reader('store', 0, 0, 0, 0)
        reader.close()
        self.assertEqual(self.server.requests[0][0], '/grid/manifest.json')
        self.assertEqual({path for path, *_ in self.server.requests[1:5]},
                         {f'/grid/{file}' for file in ('level-0.0.index', 'level-1.0.index', 'level-2.0.index', 'level-2.0.clusters')})

    def test_a_file_of_another_size_is_an_error(self):
        self.server.files['/grid/level-0.0.index'] += b'x'
        reader = Reader(f'{self.server.url}/grid')
        self.assertIn('the manifest says', reader('store'))
        reader.close()


class ReadS3(unittest.TestCase):
    """Settings and credentials; aws_signature_test.py checks the signatures."""

    def setUp(self):
        self.server = RangeServer({'/bucket/a b/ä+/key': b'contents', '/sub/key': b'other'})
        self.addCleanup(self.server.close)

    def open(self, url='s3://bucket/a b/ä+', **variables):
        environment = {'AWS_ENDPOINT_URL': self.server.url, **variables}
        reader = Reader(url, environment=environment)
        self.addCleanup(reader.close)
        return reader('open', 'key')

    def authorization(self):
        return self.server.requests[-1][3].get('authorization')

    def credentials_file(self, name, text):
        folder = tempfile.mkdtemp()
        path = os.path.join(folder, name)
        with open(path, 'w') as file:
            file.write(text)
        self.addCleanup(lambda: (os.remove(path), os.rmdir(folder)))
        return path

    def test_requests_without_credentials_are_anonymous(self):
        self.assertEqual(self.open(), '8')
        self.assertIsNone(self.authorization())
        self.assertEqual(self.open(AWS_NO_SIGN_REQUEST='YES', AWS_ACCESS_KEY_ID='K', AWS_SECRET_ACCESS_KEY='S'), '8')
        self.assertIsNone(self.authorization())

    def test_keys_of_the_environment(self):
        self.assertEqual(self.open(AWS_ACCESS_KEY_ID='KEY', AWS_SECRET_ACCESS_KEY='hush', AWS_SESSION_TOKEN='tok',
                                   AWS_REGION='eu-north-1', AWS_REQUEST_PAYER='requester'), '8')
        headers = self.server.requests[-1][3]
        self.assertIn('Credential=KEY/', headers['authorization'])
        self.assertIn('/eu-north-1/s3/', headers['authorization'])
        self.assertEqual(headers['x-amz-security-token'], 'tok')
        self.assertEqual(headers['x-amz-request-payer'], 'requester')
        self.assertNotIn('hush', str(headers))

    def test_profiles(self):
        keys = self.credentials_file('credentials', '[default]\naws_access_key_id = ONE\naws_secret_access_key = s\n'
                                     '[two]\naws_access_key_id=TWO\naws_secret_access_key=s\n')
        config = self.credentials_file('config', '[default]\nregion = r-1\n\n[profile two]\nregion = r-2\n')
        files = {'AWS_SHARED_CREDENTIALS_FILE': keys, 'AWS_CONFIG_FILE': config}
        self.assertEqual(self.open(**files), '8')
        self.assertRegex(self.authorization(), 'Credential=ONE/[0-9]+/r-1/')
        self.assertEqual(self.open(**files, AWS_PROFILE='two'), '8')
        self.assertRegex(self.authorization(), 'Credential=TWO/[0-9]+/r-2/')
        self.assertIn('no profile', self.open(**files, AWS_PROFILE='three'))

    def test_web_identity(self):
        def answer(handler):
            if handler.command != 'POST':
                return None
            self.posted = handler.body.decode()
            self.server.send(handler, 200, b'<R><Credentials><AccessKeyId>WEB</AccessKeyId><SecretAccessKey>s</SecretAccessKey>'
                             b'<SessionToken>t</SessionToken><Expiration>2099-01-01T00:00:00Z</Expiration></Credentials></R>')
            return 'done'
        self.server.access = answer
        token = self.credentials_file('token', 'to+ken\n')
        variables = {'AWS_WEB_IDENTITY_TOKEN_FILE': token, 'AWS_ROLE_ARN': 'arn:x', 'AWS_ENDPOINT_URL_STS': self.server.url}
        self.assertEqual(self.open(**variables), '8')
        self.assertIn('WebIdentityToken=to%2Bken', self.posted)
        self.assertIn('Credential=WEB/', self.authorization())

    def test_containers(self):
        def answer(handler):
            if handler.path != '/keys':
                return None
            if handler.headers.get('Authorization') != 'pass':
                return 403
            self.server.send(handler, 200, b'{"AccessKeyId": "BOX", "SecretAccessKey": "s", "Token": "t"}')
            return 'done'
        self.server.access = answer
        variables = {'AWS_CONTAINER_CREDENTIALS_FULL_URI': self.server.url + '/keys', 'AWS_CONTAINER_AUTHORIZATION_TOKEN': 'pass'}
        self.assertEqual(self.open(**variables), '8')
        self.assertIn('Credential=BOX/', self.authorization())
        variables['AWS_CONTAINER_AUTHORIZATION_TOKEN'] = 'hush'
        self.assertRegex(self.open(**variables), 'cannot get AWS credentials: status 403')

    def test_machines(self):
        role = '/latest/meta-data/iam/security-credentials/'

        def answer(handler):
            if not handler.path.startswith('/latest/'):
                return None
            if handler.path == '/latest/api/token' and handler.command == 'PUT':
                body = b'ticket'
            elif handler.headers.get('X-aws-ec2-metadata-token') != 'ticket':
                return 401
            else:
                body = b'role-1' if handler.path == role else b'{"AccessKeyId": "VM", "SecretAccessKey": "s", "Token": "t"}'
            self.server.send(handler, 200, body)
            return 'done'
        self.server.access = answer
        self.assertEqual(self.open(AWS_EC2_METADATA_DISABLED='', AWS_EC2_METADATA_SERVICE_ENDPOINT=self.server.url), '8')
        self.assertIn('Credential=VM/', self.authorization())

    def test_another_region_is_named(self):
        def answer(handler):
            self.server.send(handler, 301, b'', {'x-amz-bucket-region': 'eu-west-3'})
            return 'done'
        self.server.access = answer
        self.assertIn('the bucket is in the region eu-west-3; set AWS_REGION=eu-west-3', self.open())

    def test_errors_name_the_url_without_keys(self):
        self.server.access = lambda handler: 403
        answer = self.open(AWS_ACCESS_KEY_ID='KEY', AWS_SECRET_ACCESS_KEY='hush')
        self.assertTrue(answer.startswith('error: s3://bucket/a b/ä+/key: the server denies access'), answer)
        self.assertNotIn('KEY', answer)

    def test_buckets_in_the_host_name(self):
        port = self.server.url.rpartition(':')[2]
        # localhost and the names below it lead to this machine.
        self.assertEqual(self.open('s3://sub', AWS_ENDPOINT_URL=f'http://localhost:{port}/sub', AWS_VIRTUAL_HOSTING='TRUE'), '5')
        self.assertEqual(self.server.requests[-1][3]['host'], f'sub.localhost:{port}')


if __name__ == '__main__':
    print(f'seed {SEED}')
    unittest.main(argv=sys.argv)
