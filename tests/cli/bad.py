"""What files are refused with: a drive that is good, and bytes written as they are."""

SWEEP = '[drive]\ndirect = "1 mPa"\n[sweep]\nfrom = "0.98 f1"\nto = "1.02 f1"\n'


def write(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
