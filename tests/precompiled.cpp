// Does nothing: the headers that are precompiled for all tests need a program to belong to.
int main() {}
